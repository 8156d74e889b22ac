#include "nadir/tiff/tiff_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <optional>
#include <set>

#include "codecs.h"
#include "nadir/tiff/decode.h"
#include "pages.h"

namespace nadir::tiff {
namespace {

/// More directories, fields or bytes of a field than any writer makes.
constexpr std::size_t most_directories = 4096;
constexpr std::uint64_t most_fields = 4096, most_field_bytes = 16 << 20;
constexpr std::uint64_t most_tile_bytes = 256ull << 20;

std::uint32_t element_bytes(std::uint16_t type) {
  static constexpr std::array<std::uint32_t, 19> sizes = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};
  return type < sizes.size() ? sizes[type] : 0;
}

enum Type : std::uint16_t {
  Byte = 1,
  Ascii = 2,
  Short = 3,
  Long = 4,
  Rational = 5,
  SignedByte = 6,
  Undefined = 7,
  SignedShort = 8,
  SignedLong = 9,
  SignedRational = 10,
  Float = 11,
  Double = 12,
  Ifd = 13,
  Long8 = 16,
  SignedLong8 = 17,
  Ifd8 = 18
};

bool is_unsigned(std::uint16_t type) {
  return type == Byte || type == Short || type == Long || type == Long8 || type == Ifd || type == Ifd8;
}

template <class T>
T swapped(T value) {
  if constexpr (sizeof(T) == 2)
    return static_cast<T>(__builtin_bswap16(value));
  else if constexpr (sizeof(T) == 4)
    return static_cast<T>(__builtin_bswap32(value));
  else if constexpr (sizeof(T) == 8)
    return static_cast<T>(__builtin_bswap64(value));
  else
    return value;
}

/// A field's number where a short one belongs; 65536, which no such field holds, for all others.
std::uint32_t short_of(double value) { return value >= 0 && value < 65536 ? static_cast<std::uint32_t>(value) : 65536; }

std::optional<Codec> codec_of(std::uint64_t compression) {
  switch (compression) {
    case 1:
      return Codec::None;
    case 5:
      return Codec::Lzw;
    case 7:
      return Codec::Jpeg;
    case 8:
    case 32946:
      return Codec::Deflate;
    case 34887:
      return Codec::Lerc;
    case 34925:
      return Codec::Lzma;
    case 50000:
      return Codec::Zstd;
    case 50001:
      return Codec::WebP;
    default:
      return std::nullopt;
  }
}

}  // namespace

const Field* Directory::field(std::uint16_t tag) const {
  const auto it = std::find_if(fields.begin(), fields.end(), [&](const Field& f) { return f.tag == tag; });
  return it == fields.end() ? nullptr : &*it;
}

std::string_view to_string(Codec codec) {
  static constexpr std::array<std::string_view, 8> names = {"",     "LZW",  "DEFLATE", "ZSTD",
                                                            "LZMA", "JPEG", "WEBP",    "LERC"};
  return names[static_cast<std::size_t>(codec)];
}

TiffFile::TiffFile(std::shared_ptr<const ByteSource> source) : pages_(std::make_unique<Pages>(std::move(source))) {}
TiffFile::~TiffFile() = default;
const ByteSource& TiffFile::source() const { return pages_->source(); }

Result<void> TiffFile::read_table(std::uint64_t offset, std::span<std::byte> out) const {
  return pages_->read(offset, out);
}

template <class T>
T TiffFile::to_native(const std::byte* bytes) const {
  using Bits = std::conditional_t<sizeof(T) == 1, std::uint8_t,
                                  std::conditional_t<sizeof(T) == 2, std::uint16_t,
                                                     std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;
  Bits bits;
  std::memcpy(&bits, bytes, sizeof bits);
  if (big_endian_ != (std::endian::native == std::endian::big)) bits = swapped(bits);
  return std::bit_cast<T>(bits);
}

Result<std::shared_ptr<const TiffFile>> TiffFile::open(std::shared_ptr<const ByteSource> source) {
  std::shared_ptr<TiffFile> file(new TiffFile(std::move(source)));
  if (auto ok = file->read_directories(); !ok) return fail(ok);
  return std::shared_ptr<const TiffFile>(std::move(file));
}

Result<void> TiffFile::read_directories() {
  const std::string& name = source().name();
  std::array<std::byte, 16> header{};
  if (auto ok = pages_->read(0, std::span(header).first(8)); !ok) return ok;
  const auto* mark = reinterpret_cast<const char*>(header.data());
  big_endian_ = mark[0] == 'M';
  const auto version = to_native<std::uint16_t>(header.data() + 2);
  if (mark[0] != mark[1] || (mark[0] != 'I' && mark[0] != 'M') || (version != 42 && version != 43))
    return fail(Error::Kind::Malformed, fmt::format("{}: expected a TIFF, found other first bytes", name));
  big_ = version == 43;
  std::uint64_t next = to_native<std::uint32_t>(header.data() + 4);
  std::uint64_t after_header = 8;
  if (big_) {
    if (auto ok = pages_->read(0, header); !ok) return ok;
    if (to_native<std::uint16_t>(header.data() + 4) != 8 || to_native<std::uint16_t>(header.data() + 6) != 0)
      return fail(Error::Kind::Malformed, fmt::format("{}: expected BigTIFF offsets of 8 bytes", name));
    next = to_native<std::uint64_t>(header.data() + 8);
    after_header = 16;
  }

  // GDAL notes there in text how a file is laid out.
  std::array<char, 256> note{};
  if (source().size() >= after_header + note.size() &&
      pages_->read(after_header, std::as_writable_bytes(std::span(note)))) {
    const std::string_view text(note.data(), note.size());
    cloud_optimized_ = text.starts_with("GDAL_STRUCTURAL_METADATA_SIZE=") &&
                       text.find("LAYOUT=IFDS_BEFORE_DATA\n") != std::string_view::npos &&
                       text.find("KNOWN_INCOMPATIBLE_EDITION=YES") == std::string_view::npos;
  }

  std::set<std::uint64_t> seen;
  while (next != 0) {
    if (!seen.insert(next).second)
      return fail(Error::Kind::Malformed, fmt::format("{}: its directories run in a circle", name));
    if (seen.size() > most_directories)
      return fail(Error::Kind::Unsupported, fmt::format("{}: more than {} directories", name, most_directories));
    auto directory = read_directory(next, next);
    if (!directory) return fail(directory);
    directories_.push_back(std::move(*directory));
  }
  if (directories_.empty()) return fail(Error::Kind::Malformed, fmt::format("{}: a TIFF without a directory", name));
  return {};
}

Result<std::uint64_t> TiffFile::unsigned_value(const Field* field, std::uint64_t absent) const {
  if (!field || field->count == 0) return absent;
  if (!is_unsigned(field->type))
    return fail(Error::Kind::Malformed, fmt::format("{}: tag {}: expected a whole number, found type {}",
                                                    source().name(), field->tag, field->type));
  return unsigned_at(field->place, element_bytes(field->type));
}

Result<std::uint64_t> TiffFile::unsigned_at(std::uint64_t place, std::uint32_t size) const {
  std::array<std::byte, 8> bytes;
  if (auto ok = pages_->read(place, std::span(bytes).first(size)); !ok) return fail(ok);
  switch (size) {
    case 1:
      return to_native<std::uint8_t>(bytes.data());
    case 2:
      return to_native<std::uint16_t>(bytes.data());
    case 4:
      return to_native<std::uint32_t>(bytes.data());
    default:
      return to_native<std::uint64_t>(bytes.data());
  }
}

Result<Directory> TiffFile::read_directory(std::uint64_t place, std::uint64_t& next) const {
  const std::string& name = source().name();
  const auto malformed = [&](std::string_view what) {
    return fail(Error::Kind::Malformed, fmt::format("{}: directory at byte {}: {}", name, place, what));
  };
  const auto unsupported = [&](std::string_view what) {
    return fail(Error::Kind::Unsupported, fmt::format("{}: directory at byte {}: {}", name, place, what));
  };

  // The fields
  const std::uint32_t count_bytes = big_ ? 8 : 2, field_bytes = big_ ? 20 : 12, place_bytes = big_ ? 8 : 4;
  std::array<std::byte, 8> head;
  if (auto ok = pages_->read(place, std::span(head).first(count_bytes)); !ok) return fail(ok);
  const std::uint64_t count = big_ ? to_native<std::uint64_t>(head.data()) : to_native<std::uint16_t>(head.data());
  if (count == 0 || count > most_fields)
    return malformed(fmt::format("expected 1 to {} fields, found {}", most_fields, count));
  std::vector<std::byte> bytes(static_cast<std::size_t>(count) * field_bytes + place_bytes);
  if (auto ok = pages_->read(place + count_bytes, bytes); !ok) return fail(ok);
  Directory directory;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::byte* at = bytes.data() + i * field_bytes;
    Field field;
    field.tag = to_native<std::uint16_t>(at);
    field.type = to_native<std::uint16_t>(at + 2);
    field.count = big_ ? to_native<std::uint64_t>(at + 4) : to_native<std::uint32_t>(at + 4);
    const std::uint32_t size = element_bytes(field.type);
    if (size == 0) continue;  // of a type to come: the format says to skip it
    const std::byte* value = at + (big_ ? 12 : 8);
    if (field.count <= place_bytes / size)
      field.place = place + count_bytes + static_cast<std::uint64_t>(value - bytes.data());
    else
      field.place = big_ ? to_native<std::uint64_t>(value) : to_native<std::uint32_t>(value);
    directory.fields.push_back(field);
  }
  const std::byte* last = bytes.data() + count * field_bytes;
  next = big_ ? to_native<std::uint64_t>(last) : to_native<std::uint32_t>(last);

  // What they say
  std::optional<Error> problem;
  const auto value = [&](std::uint16_t tag, std::uint64_t absent) {
    const auto v = unsigned_value(directory.field(tag), absent);
    if (!v && !problem) problem = v.error();
    return v.value_or(0);
  };
  const std::uint64_t width = value(256, 0), height = value(257, 0), compression = value(259, 1),
                      photometric = value(262, 1), samples = value(277, 1), planar = value(284, 1),
                      predictor = value(317, 1), subfile = value(254, 0), fill_order = value(266, 1),
                      orientation = value(274, 1);
  std::uint64_t tile_width = value(322, 0), tile_height = value(323, 0);
  const bool strips = directory.field(273) && !directory.field(322) && !directory.field(323);
  if (strips) {
    tile_width = width;
    tile_height = std::min(value(278, height), height);
  }
  if (problem) return tl::unexpected(*problem);
  constexpr std::uint64_t most_texels = std::numeric_limits<std::int32_t>::max();
  if (width == 0 || height == 0 || width > most_texels || height > most_texels)
    return malformed(
        fmt::format("expected a size of 1 to {} texels a side, found {} x {}", most_texels, width, height));
  if (tile_width == 0 || tile_height == 0) return unsupported("not tiled");
  if (!strips && (tile_width > 65536 || tile_height > 65536)) return unsupported("its tiles are too large");
  if (samples == 0 || samples > 65535) return malformed(fmt::format("{} samples a texel", samples));
  const auto codec = codec_of(compression);
  if (!codec) return unsupported(fmt::format("compression {}", compression));
  if (fill_order != 1 || orientation != 1) return unsupported("another order of bits or rows");
  if (planar != 1 && planar != 2) return malformed(fmt::format("planar configuration {}", planar));
  if (predictor < 1 || predictor > 3) return unsupported(fmt::format("predictor {}", predictor));
  switch (static_cast<Photometric>(photometric)) {
    case Photometric::MinIsBlack:
    case Photometric::Rgb:
    case Photometric::Palette:
    case Photometric::TransparencyMask:
      break;
    case Photometric::YCbCr:
      if (*codec == Codec::Jpeg && samples == 3) break;
      [[fallthrough]];
    default:
      return unsupported(fmt::format("photometric interpretation {}", photometric));
  }

  directory.width = static_cast<std::uint32_t>(width);
  directory.height = static_cast<std::uint32_t>(height);
  directory.reduced = subfile & 1;
  directory.mask = subfile & 4;
  directory.strips = strips;
  TileFormat& format = directory.format;
  format.tile_width = static_cast<std::uint32_t>(tile_width);
  format.tile_height = static_cast<std::uint32_t>(tile_height);
  format.samples = static_cast<std::uint32_t>(samples);
  format.separate = planar == 2 && samples > 1;
  format.big_endian = big_endian_;
  format.codec = *codec;
  // Codecs of whole pictures know no predictor.
  const bool predictable =
      *codec == Codec::Lzw || *codec == Codec::Deflate || *codec == Codec::Zstd || *codec == Codec::Lzma;
  format.predictor = predictable ? static_cast<Predictor>(predictor) : Predictor::None;
  format.photometric = static_cast<Photometric>(photometric);

  // One width and kind for all samples
  const auto one_for_all = [&](std::uint16_t tag, std::uint64_t absent) -> Result<std::uint64_t> {
    const Field* field = directory.field(tag);
    if (!field) return absent;
    const auto all = numbers(*field);
    if (!all) return fail(all);
    if (all->empty() || std::any_of(all->begin(), all->end(), [&](double v) { return v != all->front(); }))
      return unsupported("bands of different types");
    return short_of(all->front());
  };
  const auto bits = one_for_all(258, 1), number = one_for_all(339, 1);
  if (!bits) return fail(bits);
  if (!number) return fail(number);
  format.bits = static_cast<std::uint32_t>(*bits);
  if (*bits == 0 || (*bits > 32 && *bits != 64)) return unsupported(fmt::format("samples of {} bits", *bits));
  if (*number == 1 || *number == 4)
    format.number = Number::Unsigned;  // 4: undefined, which writers mean as unsigned
  else if (*number == 2)
    format.number = Number::Signed;
  else if (*number == 3)
    format.number = Number::Float;
  else
    return unsupported(fmt::format("sample format {}", *number));
  const bool whole_bytes = format.bits % 8 == 0;
  if (format.number == Number::Float && !(whole_bytes && format.bits >= 16))
    return unsupported(fmt::format("floats of {} bits", format.bits));
  if (format.number == Number::Signed && format.bits != 8 && format.bits != 16 && format.bits != 32 &&
      format.bits != 64)
    return unsupported(fmt::format("signed integers of {} bits", format.bits));
  if (format.predictor == Predictor::Horizontal && format.bits != 8 && format.bits != 16 && format.bits != 32 &&
      format.bits != 64)
    return unsupported(fmt::format("predictor 2 over samples of {} bits", format.bits));
  if (format.predictor == Predictor::FloatingPoint && format.number != Number::Float)
    return unsupported("predictor 3 over integers");
  if ((format.codec == Codec::Jpeg || format.codec == Codec::WebP) &&
      (format.bits != 8 || format.number != Number::Unsigned))
    return unsupported(fmt::format("{} of {} bits", to_string(format.codec), format.bits));
  if (format.codec == Codec::WebP && (format.separate || (samples != 3 && samples != 4)))
    return unsupported("WebP of other than 3 or 4 bands");
  if (format.codec == Codec::Jpeg && format.samples_together() > 4) return unsupported("JPEG of more than 4 bands");
  // All of an image may be one strip, of which parts are read where nothing has to be unpacked.
  if (format.row_bytes() > most_tile_bytes ||
      (format.tile_bytes() > most_tile_bytes && !(strips && rows_lie_as_decoded(format))))
    return unsupported("its tiles are too large");
  if (const Field* extra = directory.field(338)) {
    const auto kinds = numbers(*extra);
    if (!kinds) return fail(kinds);
    if (kinds->size() > samples) return malformed("more extra samples than samples");
    for (const double kind : *kinds) directory.extra_samples.push_back(static_cast<std::uint16_t>(short_of(kind)));
  }
  if (format.codec == Codec::Lerc) {
    // With an alpha band libtiff keeps it as LERC's own mask.
    const bool alpha = !directory.extra_samples.empty() && directory.extra_samples.back() != 0;
    if (alpha || format.bits < 8 || !whole_bytes || format.bits == 24)
      return unsupported("LERC with alpha or odd widths");
    if (const Field* parameters = directory.field(50674)) {
      const auto values = numbers(*parameters);
      if (!values) return fail(values);
      if (values->size() >= 2) format.lerc_packing = static_cast<int>(short_of((*values)[1]));
      if (format.lerc_packing > 2) return unsupported("LERC of another packing");
    }
  }
  if (format.codec == Codec::Jpeg) {
    if (const Field* tables = directory.field(347)) {
      if (tables->count > 65536) return malformed("JPEG tables of more than 64 KiB");
      format.jpeg_tables.resize(static_cast<std::size_t>(tables->count));
      if (auto ok = pages_->read(tables->place, format.jpeg_tables); !ok) return fail(ok);
    }
  }

  // Where tiles lie
  const std::uint64_t planes = format.separate ? samples : 1, tiles = directory.tiles_a_plane();
  if (tiles > std::numeric_limits<std::uint64_t>::max() / 65536) return malformed("too many tiles");
  const auto table = [&](std::uint16_t tag, ArrayPlace& array) -> Result<void> {
    const Field* field = directory.field(tag);
    if (!field || !(field->type == Short || field->type == Long || field->type == Long8))
      return malformed(fmt::format("no table of its tiles in tag {}", tag));
    if (field->count < tiles * planes)
      return malformed(fmt::format("{} tiles, and {} of them in tag {}", tiles * planes, field->count, tag));
    array = {field->place, tiles * planes, element_bytes(field->type)};
    const std::uint64_t file_bytes = source().size();
    if (array.place > file_bytes || array.count > (file_bytes - array.place) / array.element_bytes)
      return malformed(
          fmt::format("its table of {} tiles reaches beyond the file's {} bytes", array.count, file_bytes));
    return {};
  };
  if (auto ok = table(strips ? 273 : 324, directory.offsets); !ok) return fail(ok);
  if (auto ok = table(strips ? 279 : 325, directory.byte_counts); !ok) return fail(ok);
  return directory;
}

Result<std::string> TiffFile::text(const Field& field) const {
  if (field.type != Ascii && field.type != Byte && field.type != Undefined)
    return fail(Error::Kind::Malformed, fmt::format("{}: tag {}: expected text", source().name(), field.tag));
  if (field.count > most_field_bytes)
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: tag {}: a text of {} bytes", source().name(), field.tag, field.count));
  std::string text(static_cast<std::size_t>(field.count), '\0');
  if (auto ok = pages_->read(field.place, std::as_writable_bytes(std::span(text))); !ok) return fail(ok);
  text.resize(std::strlen(text.c_str()));
  return text;
}

Result<std::vector<double>> TiffFile::numbers(const Field& field) const {
  const std::uint32_t size = element_bytes(field.type);
  if (field.count > most_field_bytes / size)
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: tag {}: {} numbers", source().name(), field.tag, field.count));
  std::vector<std::byte> bytes(static_cast<std::size_t>(field.count) * size);
  if (auto ok = pages_->read(field.place, bytes); !ok) return fail(ok);
  std::vector<double> values;
  for (std::uint64_t i = 0; i < field.count; ++i) {
    const std::byte* at = bytes.data() + i * size;
    switch (field.type) {
      case Byte:
      case Undefined:
        values.push_back(to_native<std::uint8_t>(at));
        break;
      case SignedByte:
        values.push_back(to_native<std::int8_t>(at));
        break;
      case Short:
        values.push_back(to_native<std::uint16_t>(at));
        break;
      case SignedShort:
        values.push_back(to_native<std::int16_t>(at));
        break;
      case Long:
      case Ifd:
        values.push_back(to_native<std::uint32_t>(at));
        break;
      case SignedLong:
        values.push_back(to_native<std::int32_t>(at));
        break;
      case Float:
        values.push_back(to_native<float>(at));
        break;
      case Double:
        values.push_back(to_native<double>(at));
        break;
      case Long8:
      case Ifd8:
        values.push_back(static_cast<double>(to_native<std::uint64_t>(at)));
        break;
      case SignedLong8:
        values.push_back(static_cast<double>(to_native<std::int64_t>(at)));
        break;
      default:
        return fail(Error::Kind::Malformed, fmt::format("{}: tag {}: expected numbers", source().name(), field.tag));
    }
  }
  return values;
}

std::vector<Result<TilePlace>> TiffFile::locate(std::span<const TileAddress> tiles) const {
  const auto index_of = [&](const TileAddress& tile) {
    const Directory& d = directories_[tile.directory];
    return tile.plane * d.tiles_a_plane() + std::uint64_t{tile.row} * d.tiles_across() + tile.col;
  };
  const auto entry = [](const ArrayPlace& array, std::uint64_t index) {
    return TilePlace{array.place + index * array.element_bytes, array.element_bytes};
  };
  if (tiles.size() > 1 && source().is_remote()) {
    std::vector<TilePlace> entries;
    for (const TileAddress& tile : tiles)
      for (const ArrayPlace* array : {&directories_[tile.directory].offsets, &directories_[tile.directory].byte_counts})
        entries.push_back(entry(*array, index_of(tile)));
    if (auto ok = pages_->prepare(entries); !ok)
      return std::vector<Result<TilePlace>>(tiles.size(), tl::unexpected(ok.error()));
  }
  std::vector<Result<TilePlace>> places;
  for (const TileAddress& tile : tiles) {
    const Directory& directory = directories_[tile.directory];
    const auto number = [&](const ArrayPlace& array) {
      return unsigned_at(entry(array, index_of(tile)).offset, array.element_bytes);
    };
    const auto offset = number(directory.offsets), size = number(directory.byte_counts);
    const auto place = [&]() -> Result<TilePlace> {
      if (!offset) return fail(offset);
      if (!size) return fail(size);
      if (*size == 0 || *offset == 0) return TilePlace{};
      if (*offset > source().size() || *size > source().size() - *offset)
        return damaged(
            fmt::format("its bytes {} to {} lie beyond the file's {}", *offset, *offset + *size, source().size()));
      if (*size > largest_packed_bytes(directory.format))
        return damaged(fmt::format("its {} bytes cannot be a tile of {}", *size, directory.format.tile_bytes()));
      return TilePlace{*offset, *size};
    };
    places.push_back(place());
  }
  return places;
}

}  // namespace nadir::tiff

#include "nadir/tiff/cog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

namespace nadir::tiff {
namespace {

enum Type : std::uint16_t { Short = 3, Long = 4, Rational = 5, Undefined = 7, Long8 = 16 };

namespace tags {
constexpr std::uint16_t new_subfile_type = 254, image_width = 256, image_length = 257, bits_per_sample = 258,
                        compression = 259, photometric = 262, samples_per_pixel = 277, planar_configuration = 284,
                        predictor = 317, tile_width = 322, tile_length = 323, tile_offsets = 324,
                        tile_byte_counts = 325, extra_samples = 338, sample_format = 339, jpeg_tables = 347,
                        ycbcr_subsampling = 530, reference_black_white = 532, lerc_parameters = 50674;
}

constexpr std::uint64_t signature_bytes_classic = 8, signature_bytes_big = 16;

template <class T>
NewField numbers(std::uint16_t tag, Type type, std::initializer_list<T> values) {
  NewField field{tag, type, values.size(), {}};
  const auto bytes = std::as_bytes(std::span(values.begin(), values.size()));
  field.values.assign(bytes.begin(), bytes.end());
  return field;
}

NewField shorts(std::uint16_t tag, const std::vector<std::uint16_t>& values) {
  NewField field{tag, Short, values.size(), {}};
  const auto bytes = std::as_bytes(std::span(values));
  field.values.assign(bytes.begin(), bytes.end());
  return field;
}

NewField number(std::uint16_t tag, std::uint16_t value) { return numbers<std::uint16_t>(tag, Short, {value}); }

NewField long_number(std::uint16_t tag, std::uint32_t value) { return numbers<std::uint32_t>(tag, Long, {value}); }

std::uint16_t code_of(Codec codec) {
  switch (codec) {
    case Codec::Lzw:
      return 5;
    case Codec::Jpeg:
      return 7;
    case Codec::Deflate:
      return 8;
    case Codec::Lerc:
      return 34887;
    case Codec::Lzma:
      return 34925;
    case Codec::Zstd:
      return 50000;
    case Codec::WebP:
      return 50001;
    case Codec::None:
      break;
  }
  return 1;
}

std::uint16_t code_of(Number number) { return number == Number::Float ? 3 : number == Number::Signed ? 2 : 1; }

/// What a reader must know to unpack tiles of a format.
std::vector<NewField> fields_of(const TileFormat& format, const std::vector<std::uint16_t>& extra_samples) {
  std::vector<NewField> fields = {
      shorts(tags::bits_per_sample, std::vector(format.samples, static_cast<std::uint16_t>(format.bits))),
      number(tags::compression, code_of(format.codec)),
      number(tags::photometric, static_cast<std::uint16_t>(format.photometric)),
      number(tags::samples_per_pixel, static_cast<std::uint16_t>(format.samples)),
      number(tags::planar_configuration, format.separate ? std::uint16_t{2} : std::uint16_t{1}),
      number(tags::tile_width, static_cast<std::uint16_t>(format.tile_width)),
      number(tags::tile_length, static_cast<std::uint16_t>(format.tile_height)),
      shorts(tags::sample_format, std::vector(format.samples, code_of(format.number)))};
  if (format.predictor != Predictor::None)
    fields.push_back(number(tags::predictor, static_cast<std::uint16_t>(format.predictor)));
  if (!extra_samples.empty()) fields.push_back(shorts(tags::extra_samples, extra_samples));
  if (!format.jpeg_tables.empty())
    fields.push_back({tags::jpeg_tables, Undefined, format.jpeg_tables.size(), format.jpeg_tables});
  if (format.photometric == Photometric::YCbCr) {
    const std::uint16_t step = format.chroma_step;
    fields.push_back(numbers<std::uint16_t>(tags::ycbcr_subsampling, Short, {step, step}));
    fields.push_back(
        numbers<std::uint32_t>(tags::reference_black_white, Rational, {0, 1, 255, 1, 128, 1, 255, 1, 128, 1, 255, 1}));
    fields.back().count /= 2;
  }
  if (format.codec == Codec::Lerc)
    fields.push_back(
        numbers<std::uint32_t>(tags::lerc_parameters, Long, {4, static_cast<std::uint32_t>(format.lerc_packing)}));
  return fields;
}

/// A directory with its values, and the tables of its tiles.
struct NewDirectory {
  std::vector<NewField> fields;  // tables are entered with no values
  std::size_t level = 0;
  bool mask = false;
  std::uint64_t tiles = 0;
};

std::uint64_t tile_count(const TileFormat& format, const CogLevel& level) {
  return (std::uint64_t{level.width - 1} / format.tile_width + 1) *
         (std::uint64_t{level.height - 1} / format.tile_height + 1) * (format.separate ? format.samples : 1);
}

NewDirectory directory_of(const CogImage& image, std::size_t level, bool mask, bool has_losses, Type offset_type) {
  const TileFormat& format = mask ? *image.mask : image.format;
  NewDirectory directory{fields_of(format, mask ? std::vector<std::uint16_t>() : image.extra_samples), level, mask,
                         tile_count(format, image.levels[level])};
  auto& fields = directory.fields;
  const std::uint32_t kind = (level > 0 ? 1u : 0u) | (mask ? 4u : 0u);
  if (kind != 0) fields.push_back(long_number(tags::new_subfile_type, kind));
  fields.push_back(long_number(tags::image_width, image.levels[level].width));
  fields.push_back(long_number(tags::image_length, image.levels[level].height));
  fields.push_back({tags::tile_offsets, offset_type, directory.tiles, {}});
  fields.push_back({tags::tile_byte_counts, Long, directory.tiles, {}});
  if (!mask) {
    if (level == 0) fields.insert(fields.end(), image.fields.begin(), image.fields.end());
    fields.insert(fields.end(), image.shared_fields.begin(), image.shared_fields.end());
    if (has_losses) fields.push_back({tag::tile_losses, offset_type, 2, {}});
  }
  std::sort(fields.begin(), fields.end(), [](const NewField& a, const NewField& b) { return a.tag < b.tag; });
  return directory;
}

/// As GDAL orders them: the image, its mask, the coarser levels, their masks.
std::vector<NewDirectory> directories_of(const CogImage& image, std::span<const TileLosses> losses, bool big) {
  const Type offset_type = big ? Long8 : Long;
  std::vector<NewDirectory> directories;
  const auto add = [&](std::size_t level, bool mask) {
    directories.push_back(directory_of(image, level, mask, !losses[level].empty(), offset_type));
  };
  add(0, false);
  if (image.mask) add(0, true);
  for (std::size_t level = 1; level < image.levels.size(); ++level) add(level, false);
  for (std::size_t level = 1; image.mask && level < image.levels.size(); ++level) add(level, true);
  return directories;
}

std::string notes_for_gdal(bool with_mask) {
  std::string notes =
      "LAYOUT=IFDS_BEFORE_DATA\nBLOCK_ORDER=ROW_MAJOR\nBLOCK_LEADER=SIZE_AS_UINT4\n"
      "BLOCK_TRAILER=LAST_4_BYTES_REPEATED\nKNOWN_INCOMPATIBLE_EDITION=NO\n ";  // which GDAL turns to YES in place
  if (with_mask) notes += "MASK_INTERLEAVED_WITH_IMAGERY=YES\n";
  std::string size = std::to_string(notes.size());
  size.insert(0, 6 - size.size(), '0');
  return "GDAL_STRUCTURAL_METADATA_SIZE=" + size + " bytes\n" + notes;
}

std::uint64_t even(std::uint64_t bytes) { return (bytes + 1) / 2 * 2; }

std::uint64_t size_of(const NewField& field) {
  switch (field.type) {
    case Long8:
      return 8 * field.count;
    case Long:
      return 4 * field.count;
    default:
      return field.values.size();
  }
}

bool is_table(const NewField& field) { return field.tag == tags::tile_offsets || field.tag == tags::tile_byte_counts; }

/// Writes a header, or measures one.
///
/// Directories come first, each with its values right behind, then the tables of tiles: a reader that wants directories
/// alone gets them in one piece.
class HeaderWriter {
 public:
  HeaderWriter(const CogImage& image, std::span<const TileLosses> losses, bool big)
      : big_(big), notes_(notes_for_gdal(image.mask.has_value())), directories_(directories_of(image, losses, big)) {
    std::uint64_t end = even((big ? signature_bytes_big : signature_bytes_classic) + notes_.size());
    for (const NewDirectory& directory : directories_) {
      begins_.push_back(end);
      end += directory_bytes(directory);
      for (const NewField& field : directory.fields)
        if (!fits_inside(field) && !is_table(field)) end += even(size_of(field));
    }
    tables_begin_ = end;
    for (const NewDirectory& directory : directories_)
      for (const NewField& field : directory.fields)
        if (!fits_inside(field) && is_table(field)) end += even(size_of(field));
    bytes_ = end;
  }

  std::uint64_t bytes() const { return bytes_; }

  std::vector<std::byte> write(std::span<const TileSizes> sizes, std::span<const TileLosses> losses,
                               const CogArrangement& arrangement) {
    out_.resize(arrangement.data_begin);
    put_signature();
    std::uint64_t tables = tables_begin_;
    for (std::size_t i = 0; i < directories_.size(); ++i) {
      const NewDirectory& directory = directories_[i];
      const auto& offsets = (directory.mask ? arrangement.mask : arrangement.imagery)[directory.level];
      const TileSizes& all_sizes = sizes[directory.level];
      const auto& bytes = directory.mask ? all_sizes.mask : all_sizes.imagery;
      const std::uint64_t losses_at = arrangement.losses[directory.level];
      std::uint64_t at = begins_[i], values = at + directory_bytes(directory);
      put_count(at, directory.fields.size());
      for (const NewField& field : directory.fields) {
        put<std::uint16_t>(at, field.tag);
        put<std::uint16_t>(at, field.type);
        put_offset(at, field.count);
        std::uint64_t place = at;
        if (!fits_inside(field)) {
          std::uint64_t& next = is_table(field) ? tables : values;
          place = next;
          next += even(size_of(field));
          std::uint64_t entry = at;
          put_offset(entry, place);
        }
        at += big_ ? 8 : 4;
        if (field.tag == tags::tile_offsets)
          for (const std::uint64_t offset : offsets) put_offset(place, offset);
        else if (field.tag == tags::tile_byte_counts)
          std::memcpy(out_.data() + place, bytes.data(), bytes.size() * sizeof bytes.front());
        else if (field.tag == tag::tile_losses) {
          put_offset(place, losses_at);
          put_offset(place, losses[directory.level].size());
        } else {
          std::copy(field.values.begin(), field.values.end(), out_.begin() + static_cast<std::ptrdiff_t>(place));
        }
      }
      put_offset(at, i + 1 < directories_.size() ? begins_[i + 1] : 0);
    }
    return std::move(out_);
  }

 private:
  bool fits_inside(const NewField& field) const { return size_of(field) <= (big_ ? 8u : 4u); }
  std::uint64_t directory_bytes(const NewDirectory& directory) const {
    return big_ ? 16 + 20 * directory.fields.size() : 6 + 12 * directory.fields.size();
  }

  void put_signature() {
    std::uint64_t at = 0;
    put<std::uint16_t>(at, 0x4949);  // "II": little-endian
    put<std::uint16_t>(at, big_ ? 43 : 42);
    if (big_) put<std::uint32_t>(at, 8);  // bytes of an offset
    put_offset(at, begins_.front());
    std::memcpy(out_.data() + at, notes_.data(), notes_.size());
  }

  template <class T>
  void put(std::uint64_t& at, T value) {
    std::memcpy(out_.data() + at, &value, sizeof value);
    at += sizeof value;
  }
  void put_offset(std::uint64_t& at, std::uint64_t value) {
    if (big_)
      put<std::uint64_t>(at, value);
    else
      put<std::uint32_t>(at, static_cast<std::uint32_t>(value));
  }
  void put_count(std::uint64_t& at, std::uint64_t value) {
    if (big_)
      put<std::uint64_t>(at, value);
    else
      put<std::uint16_t>(at, static_cast<std::uint16_t>(value));
  }

  bool big_;
  std::string notes_;
  std::vector<NewDirectory> directories_;
  std::vector<std::uint64_t> begins_;
  std::uint64_t tables_begin_ = 0, bytes_ = 0;
  std::vector<std::byte> out_;
};

CogArrangement arrange(const CogImage& image, std::span<const TileSizes> sizes, std::span<const TileLosses> losses,
                       std::uint64_t spare_bytes, bool big) {
  CogArrangement arrangement;
  arrangement.big = big;
  arrangement.data_begin = (HeaderWriter(image, losses, big).bytes() + spare_bytes + 15) / 16 * 16;
  const std::size_t levels = image.levels.size();
  arrangement.imagery.resize(levels);
  arrangement.mask.resize(levels);
  arrangement.losses.resize(levels);
  std::uint64_t end = arrangement.data_begin;
  const auto place = [&](std::uint32_t bytes) -> std::uint64_t {
    if (bytes == 0) return 0;
    const std::uint64_t at = end + tile_leader_bytes;
    end = at + bytes + tile_trailer_bytes;
    return at;
  };
  for (std::size_t level = levels; level-- > 0;) {
    const TileSizes& of_level = sizes[level];
    arrangement.imagery[level].resize(of_level.imagery.size());
    arrangement.mask[level].resize(of_level.mask.size());
    for (std::size_t tile = 0; tile < of_level.imagery.size(); ++tile) {
      arrangement.imagery[level][tile] = place(of_level.imagery[tile]);
      if (!of_level.mask.empty()) arrangement.mask[level][tile] = place(of_level.mask[tile]);
    }
  }
  end = (end + 3) / 4 * 4;
  for (std::size_t level = 0; level < levels; ++level) {
    if (losses[level].empty()) continue;
    arrangement.losses[level] = end;
    end += losses[level].size() * sizeof(float);
  }
  arrangement.file_bytes = end;
  return arrangement;
}

}  // namespace

Result<std::uint32_t> append_tile(const TileEncoder& encoder, const std::byte* first_row, std::size_t stride,
                                  RawBytes& out) {
  const std::size_t begin = out.size();
  out.resize(begin + tile_leader_bytes);
  const auto packed = encoder.append(first_row, stride, out);
  if (!packed) return fail(packed);
  const auto size = static_cast<std::uint32_t>(*packed);
  std::memcpy(out.data() + begin, &size, sizeof size);
  // A tile of fewer bytes is led by zeros.
  const std::size_t end = out.size(), last = std::min<std::size_t>(size, tile_trailer_bytes);
  out.resize(end + tile_trailer_bytes);
  std::memset(out.data() + end, 0, tile_trailer_bytes);
  std::memcpy(out.data() + end + tile_trailer_bytes - last, out.data() + end - last, last);
  return size;
}

CogArrangement arrange(const CogImage& image, std::span<const TileSizes> sizes, std::span<const TileLosses> losses,
                       std::uint64_t spare_bytes) {
  CogArrangement classic = arrange(image, sizes, losses, spare_bytes, /*big=*/false);
  if (classic.file_bytes <= std::numeric_limits<std::uint32_t>::max()) return classic;
  return arrange(image, sizes, losses, spare_bytes, /*big=*/true);
}

Result<std::vector<std::byte>> header(const CogImage& image, std::span<const TileSizes> sizes,
                                      std::span<const TileLosses> losses, const CogArrangement& arrangement) {
  HeaderWriter writer(image, losses, arrangement.big);
  if (writer.bytes() > arrangement.data_begin)
    return fail(Error::Kind::OverBudget,
                fmt::format("headers of {} bytes where tiles begin behind {}: fields have grown by more than the bytes "
                            "that were left for them",
                            writer.bytes(), arrangement.data_begin));
  return writer.write(sizes, losses, arrangement);
}

}  // namespace nadir::tiff

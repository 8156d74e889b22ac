#include "tiff_tiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>

#include "nadir/tiff/cog.h"

namespace nadir::tile {
namespace {

using tiff::Directory, tiff::Sample, tiff::TileAddress, tiff::TileFormat, tiff::TilePlace;

/// Rows of a tile whose rows lie in the file as they are wanted are read so many bytes at a time: what was read is then
/// still in the nearest caches when it is laid out.
constexpr std::size_t bytes_read_at_once = 256 << 10;

/// Picks samples of a row: `from` has `pitch` of them a texel, of which those at `picks` are wanted.
template <class From, class To>
void pick(const From* from, std::size_t pitch, std::span<const std::uint32_t> picks, std::size_t texels, To* to,
          std::size_t to_pitch) {
  for (std::size_t b = 0; b < picks.size(); ++b) {
    const From* source = from + picks[b];
    To* out = to + b;
    for (std::size_t x = 0; x < texels; ++x) out[x * to_pitch] = static_cast<To>(source[x * pitch]);
  }
}

void pick_samples(Sample sample, const std::byte* from, std::size_t pitch, std::span<const std::uint32_t> picks,
                  std::size_t texels, SampleType type, std::byte* to, std::size_t to_pitch) {
  tiff::with_sample(sample, [&]<class From>(From) {
    with_sample_type(type, [&]<class To>(To) {
      pick(reinterpret_cast<const From*>(from), pitch, picks, texels, reinterpret_cast<To*>(to), to_pitch);
    });
  });
}

/// Alpha below half is no ground.
void alpha_to_validity(Sample sample, const std::byte* from, std::size_t pitch, std::size_t at, std::size_t texels,
                       std::uint8_t* valid) {
  tiff::with_sample(sample, [&]<class T>(T) {
    if constexpr (std::is_integral_v<T>) {
      constexpr T half = static_cast<T>(std::numeric_limits<T>::max() / 2);
      for (std::size_t x = 0; x < texels; ++x) valid[x] = reinterpret_cast<const T*>(from)[x * pitch + at] > half;
    } else {
      for (std::size_t x = 0; x < texels; ++x) valid[x] = reinterpret_cast<const T*>(from)[x * pitch + at] >= 0.5;
    }
  });
}

/// A thread's buffer for packed bytes, which does not keep what only a rare tile needs.
class PackedBuffer {
 public:
  PackedBuffer() = default;
  ~PackedBuffer() {
    constexpr std::size_t most_kept_bytes = 16 << 20;
    if (bytes.size() > most_kept_bytes) std::vector<std::byte>().swap(bytes);
  }
  PackedBuffer(const PackedBuffer&) = delete;
  PackedBuffer& operator=(const PackedBuffer&) = delete;

  std::vector<std::byte>& bytes = of_thread();

 private:
  static std::vector<std::byte>& of_thread() {
    static thread_local std::vector<std::byte> buffer;
    return buffer;
  }
};

}  // namespace

std::optional<SampleType> held_as(Sample sample) {
  switch (sample) {
    case Sample::U8:
      return SampleType::UInt8;
    case Sample::U16:
      return SampleType::UInt16;
    case Sample::I16:
      return SampleType::Int16;
    case Sample::I8:
      return std::nullopt;
    default:
      return SampleType::Float32;
  }
}

TiffTiles::TiffTiles(std::shared_ptr<const tiff::TiffFile> file, const MapDescription& description)
    : file_(std::move(file)), path_(description.path) {}

const Directory& TiffTiles::image(int level) const {
  return file_->directories()[levels_[static_cast<std::size_t>(level)].image];
}

Result<std::shared_ptr<const TiffTiles>> TiffTiles::make(std::shared_ptr<const tiff::TiffFile> file,
                                                         const MapDescription& description) {
  std::shared_ptr<TiffTiles> tiles(new TiffTiles(std::move(file), description));
  const auto& directories = tiles->file_->directories();
  const auto unsupported = [&](const std::string& what) {
    return fail(Error::Kind::Unsupported, fmt::format("{}: {}", description.path, what));
  };

  const auto find = [&](const Level& level, bool first, bool mask) -> std::optional<std::uint32_t> {
    for (std::uint32_t i = 0; i < directories.size(); ++i) {
      const Directory& d = directories[i];
      if (d.width == static_cast<std::uint32_t>(level.width) && d.height == static_cast<std::uint32_t>(level.height) &&
          d.mask == mask && d.reduced == !first)
        return i;
    }
    return std::nullopt;
  };
  for (const Level& level : description.levels) {
    const bool first = tiles->levels_.empty();
    const auto image = find(level, first, false);
    if (!image) return unsupported(fmt::format("its level of {} x {} lies elsewhere", level.width, level.height));
    const TileFormat &format = directories[*image].format, &full = directories.front().format;
    if (format.samples != full.samples || tiff::decoded_sample(format) != tiff::decoded_sample(full))
      return unsupported("its levels hold different samples");
    if (static_cast<std::uint32_t>(level.tile_width) != format.tile_width ||
        static_cast<std::uint32_t>(level.tile_height) != format.tile_height)
      return unsupported("its tiles are not those of its description");
    LevelDirectories found{*image, std::nullopt};
    if (description.validity == ValiditySource::Mask) {
      found.mask = find(level, first, true);
      if (!found.mask) return unsupported("the mask of some level lies elsewhere");
      const TileFormat& mask = directories[*found.mask].format;
      if (mask.samples != 1 || mask.bits > 8 || mask.number != tiff::Number::Unsigned ||
          mask.tile_width != format.tile_width || mask.tile_height != format.tile_height)
        return unsupported("its mask is not one band in tiles like those of its image");
    }
    tiles->levels_.push_back(found);
  }
  const TileFormat& full = directories.front().format;
  if (full.samples != description.bands.size()) return unsupported("its bands are not those of its description");
  const auto held = held_as(tiff::decoded_sample(full));
  for (std::size_t b = 0; b < description.bands.size(); ++b) {
    const Band& band = description.bands[b];
    if (!band.sample_type || band.sample_type != held)
      return unsupported("its samples are not those of its description");
    if (band.color == "Alpha" && description.validity == ValiditySource::Alpha) tiles->alpha_ = static_cast<int>(b) + 1;
  }
  if (description.validity == ValiditySource::Alpha && !tiles->alpha_) return unsupported("its alpha lies elsewhere");
  for (int k = 0; k < static_cast<int>(description.levels.size()); ++k)
    tiles->loss_tables_.push_back(tiles->loss_table(k));
  tiles->missing_ = description.bands.front().nodata.value_or(0);
  return std::shared_ptr<const TiffTiles>(std::move(tiles));
}

std::optional<TiffTiles::LossTable> TiffTiles::loss_table(int level) const {
  const Directory& directory = image(level);
  const tiff::Field* field = directory.field(tiff::tag::tile_losses);
  if (!field) return std::nullopt;
  const auto place = file_->numbers(*field);
  const std::uint64_t tiles = directory.tiles_a_plane();
  if (!place || place->size() != 2 || !((*place)[1] > 0)) return std::nullopt;
  const auto count = static_cast<std::uint64_t>((*place)[1]);
  if (count % tiles != 0) return std::nullopt;
  return LossTable{static_cast<std::uint64_t>((*place)[0]), static_cast<std::uint32_t>(count / tiles)};
}

std::optional<double> TiffTiles::loss(int level, const Window& window, std::span<const int> bands) const {
  const auto& table = loss_tables_[static_cast<std::size_t>(level)];
  if (!table) return std::nullopt;
  const Directory& directory = image(level);
  const auto first_of = [](std::int32_t begin, std::uint32_t side) { return static_cast<std::uint32_t>(begin) / side; };
  const auto end_of = [](std::int32_t end, std::uint32_t side) {
    return (static_cast<std::uint32_t>(end) - 1) / side + 1;
  };
  const auto [tile_width, tile_height] = std::pair(directory.format.tile_width, directory.format.tile_height);
  const std::uint32_t first = first_of(window.x, tile_width), end = end_of(window.x + window.width, tile_width);
  std::vector<float> row(static_cast<std::size_t>(end - first) * table->bands);
  double sum = 0, count = 0;
  for (std::uint32_t y = first_of(window.y, tile_height); y < end_of(window.y + window.height, tile_height); ++y) {
    const std::uint64_t at = (y * directory.tiles_across() + first) * table->bands * sizeof(float);
    if (!file_->read_table(table->offset + at, std::as_writable_bytes(std::span(row)))) return std::nullopt;
    for (std::size_t i = 0; i < row.size(); i += table->bands)
      for (const int band : bands) {
        if (band > static_cast<int>(table->bands)) return std::nullopt;
        const double loss = row[i + static_cast<std::size_t>(band) - 1];
        if (!std::isfinite(loss)) return std::nullopt;
        sum += loss * loss;
        ++count;
      }
  }
  return std::sqrt(sum / count);
}

std::vector<std::uint32_t> TiffTiles::planes_of(std::span<const int> bands) const {
  if (!image(0).format.separate) return {0};
  std::vector<std::uint32_t> planes;
  for (const int band : bands) planes.push_back(static_cast<std::uint32_t>(band) - 1);
  if (alpha_) planes.push_back(static_cast<std::uint32_t>(*alpha_) - 1);
  return planes;
}

Error TiffTiles::damage(const TileKey& tile, const std::string& cause) const {
  return {Error::Kind::Damaged, fmt::format("{}: level {}, tile ({}, {}): {}; fetch or build it again", path_,
                                            tile.level, tile.col, tile.row, cause)};
}

std::vector<Result<PackedTile>> TiffTiles::fetch(std::span<const TileKey> tiles, std::span<const int> bands) const {
  const std::vector<std::uint32_t> planes = planes_of(bands);
  std::vector<TileAddress> addresses;
  for (const TileKey& tile : tiles) {
    const LevelDirectories& level = levels_[static_cast<std::size_t>(tile.level)];
    const auto col = static_cast<std::uint32_t>(tile.col), row = static_cast<std::uint32_t>(tile.row);
    for (const std::uint32_t plane : planes) addresses.push_back({level.image, plane, col, row});
    if (level.mask) addresses.push_back({*level.mask, 0, col, row});
  }
  const auto places = file_->locate(addresses);

  std::vector<Result<PackedTile>> packed(tiles.size(), PackedTile{});
  std::vector<ByteRequest> requests;
  auto place = places.begin();
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const bool masked = levels_[static_cast<std::size_t>(tiles[i].level)].mask.has_value();
    const auto part = std::span(&*place, planes.size() + masked);
    place += static_cast<std::ptrdiff_t>(part.size());
    const auto bad = std::find_if(part.begin(), part.end(), [](const auto& p) { return !p.has_value(); });
    if (bad != part.end()) {
      const Error& error = bad->error();
      packed[i] = tl::unexpected<Error>(error.kind == Error::Kind::Damaged ? damage(tiles[i], error.message) : error);
      continue;
    }
    const auto want = [&](const TilePlace& p) {
      std::vector<std::byte> bytes(static_cast<std::size_t>(p.size));
      if (!bytes.empty()) requests.push_back({p.offset, bytes});
      return bytes;
    };
    for (std::size_t b = 0; b < planes.size(); ++b) packed[i]->planes.push_back(want(*part[b]));
    if (masked) packed[i]->mask = want(*part[planes.size()]);
  }
  if (auto ok = file_->source().read_many(requests); !ok)
    for (auto& tile : packed)
      if (tile) tile = tl::unexpected(ok.error());
  return packed;
}

/// The packed bytes of a tile, read into `buffer`; empty where it was never written.
Result<std::span<const std::byte>> TiffTiles::packed_plane(const TileAddress& tile,
                                                           std::vector<std::byte>& buffer) const {
  const auto place = file_->locate({&tile, 1}).front();
  if (!place) return fail(place);
  if (buffer.size() < place->size) buffer.resize(static_cast<std::size_t>(place->size));
  const std::span<std::byte> bytes = std::span(buffer).first(static_cast<std::size_t>(place->size));
  if (auto ok = file_->source().read(place->offset, bytes); !ok) return fail(ok);
  return bytes;
}

Result<void> TiffTiles::read(const TileKey& tile, std::span<const int> bands, SampleType type, const PackedTile* packed,
                             const TexelRowSink& sink) const {
  const LevelDirectories& level = levels_[static_cast<std::size_t>(tile.level)];
  const Directory& directory = file_->directories()[level.image];
  const TileFormat& format = directory.format;
  const auto col = static_cast<std::uint32_t>(tile.col), row = static_cast<std::uint32_t>(tile.row);
  assert(col < directory.tiles_across() && row < directory.tiles_down());
  const std::uint32_t texels = std::min(format.tile_width, directory.width - col * format.tile_width);
  const std::uint32_t rows = std::min(format.tile_height, directory.height - row * format.tile_height);
  const Sample stored = tiff::decoded_sample(format);
  PackedBuffer packed_buffer;
  std::vector<std::byte>& buffer = packed_buffer.bytes;
  const auto told = [&](const Error& error) -> tl::unexpected<Error> {
    return tl::unexpected<Error>(error.kind == Error::Kind::Damaged ? damage(tile, error.message) : error);
  };

  // Validity that lies apart: a mask tile
  std::vector<std::uint8_t> valid;
  if (level.mask) {
    valid.assign(std::size_t{rows} * texels, 0);
    const TileFormat& mask = file_->directories()[*level.mask].format;
    std::span<const std::byte> bytes;
    if (packed)
      bytes = packed->mask;
    else if (const auto read = packed_plane({*level.mask, 0, col, row}, buffer))
      bytes = *read;
    else
      return told(read.error());
    const std::uint8_t half = static_cast<std::uint8_t>(mask.bits == 8 ? 128 : 1);
    if (!bytes.empty()) {
      auto ok = tiff::decode_tile(mask, bytes, rows, [&](std::uint32_t y, const std::byte* data) {
        const auto* values = reinterpret_cast<const std::uint8_t*>(data);
        for (std::uint32_t x = 0; x < texels; ++x) valid[std::size_t{y} * texels + x] = values[x] >= half;
      });
      if (!ok) return told(ok.error());
    }
  }

  // What rows hold, and what is wanted of it
  const std::size_t pitch = format.samples_together(), texel_bytes = bands.size() * size_bytes(type);
  std::vector<std::uint32_t> picks;
  const bool own_type = stored == Sample::F32 || (held_as(stored) == type && type != SampleType::Float32);
  bool as_it_is = own_type && bands.size() == pitch;
  for (std::size_t b = 0; b < bands.size(); ++b) {
    picks.push_back(static_cast<std::uint32_t>(bands[b]) - 1);
    as_it_is = as_it_is && picks[b] == b;
  }
  std::vector<std::uint8_t> alpha_row(alpha_ ? texels : 0);
  std::vector<std::byte> picked_row(as_it_is ? 0 : texels * texel_bytes);
  const auto deliver = [&](std::uint32_t y, const std::byte* samples) {
    sink(y, samples, level.mask ? valid.data() + std::size_t{y} * texels : alpha_ ? alpha_row.data() : nullptr, texels);
  };
  const auto interleaved_row = [&](std::uint32_t y, const std::byte* data) {
    if (alpha_) alpha_to_validity(stored, data, pitch, static_cast<std::size_t>(*alpha_) - 1, texels, alpha_row.data());
    if (as_it_is) return deliver(y, data);
    pick_samples(stored, data, pitch, picks, texels, type, picked_row.data(), bands.size());
    deliver(y, picked_row.data());
  };

  // A tile that was never written
  const auto never_written = [&] {
    std::vector<std::byte> row_of_missing(texels * texel_bytes);
    with_sample_type(type, [&]<class T>(T) {
      const bool fits = missing_ >= std::numeric_limits<T>::lowest() && missing_ <= std::numeric_limits<T>::max();
      std::fill_n(reinterpret_cast<T*>(row_of_missing.data()), texels * bands.size(),
                  std::is_floating_point_v<T> || fits ? static_cast<T>(missing_) : T{});
    });
    std::fill(alpha_row.begin(), alpha_row.end(), std::uint8_t{0});
    for (std::uint32_t y = 0; y < rows; ++y) deliver(y, row_of_missing.data());
  };

  if (!format.separate) {
    const TileAddress address{level.image, 0, col, row};
    if (packed) {
      if (packed->planes.front().empty()) return never_written(), Result<void>{};
      auto ok = tiff::decode_tile(format, packed->planes.front(), rows, interleaved_row);
      return ok ? ok : told(ok.error());
    }
    if (!tiff::rows_lie_as_decoded(format)) {
      const auto bytes = packed_plane(address, buffer);
      if (!bytes) return told(bytes.error());
      if (bytes->empty()) return never_written(), Result<void>{};
      auto ok = tiff::decode_tile(format, *bytes, rows, interleaved_row);
      return ok ? ok : told(ok.error());
    }
    const auto place = file_->locate({&address, 1}).front();
    if (!place) return told(place.error());
    if (place->size == 0) return never_written(), Result<void>{};
    const auto row_bytes = static_cast<std::size_t>(format.row_bytes());
    if (place->size < row_bytes * rows)
      return tl::unexpected(damage(tile, fmt::format("{} bytes of {}", place->size, format.tile_bytes())));
    const auto rows_at_once = static_cast<std::uint32_t>(std::max<std::size_t>(1, bytes_read_at_once / row_bytes));
    if (buffer.size() < rows_at_once * row_bytes) buffer.resize(rows_at_once * row_bytes);
    for (std::uint32_t first = 0; first < rows; first += rows_at_once) {
      const std::uint32_t n = std::min(rows_at_once, rows - first);
      if (auto ok = file_->source().read(place->offset + first * row_bytes, std::span(buffer).first(n * row_bytes));
          !ok)
        return ok;
      for (std::uint32_t y = 0; y < n; ++y) interleaved_row(first + y, buffer.data() + y * row_bytes);
    }
    return {};
  }

  // Bands that lie apart are put together first
  std::vector<std::byte> together(std::size_t{rows} * texels * texel_bytes);
  std::vector<std::uint8_t> alpha_tile(alpha_ ? std::size_t{rows} * texels : 0);
  const std::vector<std::uint32_t> planes = planes_of(bands);
  for (std::size_t p = 0; p < planes.size(); ++p) {
    std::span<const std::byte> bytes;
    if (packed)
      bytes = packed->planes[p];
    else if (const auto read = packed_plane({level.image, planes[p], col, row}, buffer))
      bytes = *read;
    else
      return told(read.error());
    const bool is_alpha = p == bands.size();
    static constexpr std::uint32_t only = 0;
    if (bytes.empty()) {
      with_sample_type(type, [&]<class T>(T) {
        for (std::size_t i = 0; i < std::size_t{rows} * texels && !is_alpha; ++i)
          reinterpret_cast<T*>(together.data())[i * bands.size() + p] = static_cast<T>(missing_);
      });
      continue;
    }
    auto ok = tiff::decode_tile(format, bytes, rows, [&](std::uint32_t y, const std::byte* data) {
      if (is_alpha) return alpha_to_validity(stored, data, 1, 0, texels, alpha_tile.data() + std::size_t{y} * texels);
      pick_samples(stored, data, 1, {&only, 1}, texels, type,
                   together.data() + std::size_t{y} * texels * texel_bytes + p * size_bytes(type), bands.size());
    });
    if (!ok) return told(ok.error());
  }
  for (std::uint32_t y = 0; y < rows; ++y) {
    if (alpha_) std::copy_n(alpha_tile.data() + std::size_t{y} * texels, texels, alpha_row.data());
    deliver(y, together.data() + std::size_t{y} * texels * texel_bytes);
  }
  return {};
}

}  // namespace nadir::tile

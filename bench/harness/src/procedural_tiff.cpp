#include "nadir/bench/procedural_tiff.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <libdeflate.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "nadir/base/files.h"

namespace nadir::bench {
namespace {

static_assert(std::endian::native == std::endian::little,
              "files are little-endian and written as values lie in memory");

constexpr std::size_t kept_tiles = 256;
constexpr std::uint64_t place_alignment = 4096;  // holes of a file begin and end at its blocks
constexpr std::uint64_t header_bytes = 16, entry_bytes = 20;

std::size_t sample_bytes(SampleType type) { return type == SampleType::u8 ? 1 : type == SampleType::u16 ? 2 : 4; }

std::uint64_t align(std::uint64_t value, std::uint64_t to) { return (value + to - 1) / to * to; }

/// Mixes all bits of `v`. Source: Steele, Lea, Flood, Fast Splittable Pseudorandom Number Generators, 2014 (finalizer
/// of SplitMix64).
std::uint64_t mix(std::uint64_t v) {
  v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9u;
  v = (v ^ (v >> 27)) * 0x94d049bb133111ebu;
  return v ^ (v >> 31);
}

/// 16 random bits of a place in a plane.
std::uint32_t noise(std::uint64_t plane, std::int64_t x, std::int64_t y) {
  const std::uint64_t seed = mix(plane + 0x9e3779b97f4a7c15u);
  return static_cast<std::uint32_t>(mix(seed ^ (static_cast<std::uint64_t>(x) << 32 ^ static_cast<std::uint64_t>(y))) >>
                                    48);
}

/// a at t = 0 to b at t = 65536; all below 65536, so that nothing overflows 32 bits.
std::uint32_t between(std::uint32_t a, std::uint32_t b, std::uint32_t t) { return (a * (65536 - t) + b * t) >> 16; }

/// Adds hills: random heights at each 2^period-th texel of `level`, linear in
/// between.
void add_hills(std::uint64_t plane, int period, std::int64_t x0, std::int64_t y, std::size_t n, std::uint32_t* sum) {
  const std::int64_t side = std::int64_t{1} << period;
  const auto fraction = [&](std::int64_t v) {
    const auto within = static_cast<std::uint64_t>(v & (side - 1));
    return static_cast<std::uint32_t>(period > 16 ? within >> (period - 16) : within << (16 - period));
  };
  const std::int64_t row = y >> period;
  const auto height = [&](std::int64_t column) {
    return between(noise(plane, column, row), noise(plane, column, row + 1), fraction(y));
  };
  for (std::size_t i = 0; i < n;) {
    const std::int64_t column = (x0 + static_cast<std::int64_t>(i)) >> period;
    const std::uint32_t left = height(column), right = height(column + 1);
    const auto end = std::min<std::int64_t>(static_cast<std::int64_t>(n), ((column + 1) << period) - x0);
    for (; static_cast<std::int64_t>(i) < end; ++i)
      sum[i] += between(left, right, fraction(x0 + static_cast<std::int64_t>(i)));
  }
}

/// The directory of one level in the making: entries sorted by tag, and behind them what does not fit into an entry.
class Directory {
 public:
  enum Type : std::uint16_t { ascii = 2, u16 = 3, u32 = 4, f64 = 12, u64 = 16 };

  template <class T>
  void add(std::uint16_t tag, Type type, const std::vector<T>& values) {
    Entry entry{tag, type, values.size(), {}};
    entry.value.resize(values.size() * sizeof(T));
    std::memcpy(entry.value.data(), values.data(), entry.value.size());
    entries_.push_back(std::move(entry));
  }
  /// Values that lie elsewhere in the file.
  void add_elsewhere(std::uint16_t tag, std::uint64_t count, std::uint64_t offset) {
    add(tag, u64, std::vector<std::uint64_t>{offset});
    entries_.back().count = count;
  }

  std::uint64_t size() const {
    std::uint64_t bytes = 8 + entry_bytes * entries_.size() + 8;
    for (const Entry& entry : entries_)
      if (entry.value.size() > 8) bytes += align(entry.value.size(), 8);
    return align(bytes, 8);
  }

  /// `at`: where in the file; `next`: the following directory, or 0.
  void write(std::uint64_t at, std::uint64_t next, std::vector<std::byte>& file) const {
    file.resize(at + size());
    std::byte* out = file.data() + at;
    const auto put = [&](const auto& value) {
      std::memcpy(out, &value, sizeof value);
      out += sizeof value;
    };
    put(std::uint64_t{entries_.size()});
    std::uint64_t behind = align(at + 8 + entry_bytes * entries_.size() + 8, 8);
    for (const Entry& entry : entries_) {
      put(entry.tag);
      put(entry.type);
      put(entry.count);
      if (entry.value.size() <= 8) {
        std::memcpy(out, entry.value.data(), entry.value.size());
        out += 8;
      } else {
        put(behind);
        std::memcpy(file.data() + behind, entry.value.data(), entry.value.size());
        behind += align(entry.value.size(), 8);
      }
    }
    put(next);
  }

 private:
  struct Entry {
    std::uint16_t tag;
    std::uint16_t type;
    std::uint64_t count;
    std::vector<std::byte> value;
  };
  std::vector<Entry> entries_;
};

struct FreeCompressor {
  void operator()(libdeflate_compressor* c) const noexcept { libdeflate_free_compressor(c); }
};

std::size_t compress_bound(Codec codec, std::size_t bytes) {
  switch (codec) {
    case Codec::none:
      return bytes;
    case Codec::deflate:
      return libdeflate_zlib_compress_bound(nullptr, bytes);
    case Codec::zstd:
      break;
  }
  return ZSTD_compressBound(bytes) + 8;  // a frame to skip, for filling up
}

std::vector<std::byte> compress(Codec codec, std::vector<std::byte> samples) {
  if (codec == Codec::none) return samples;
  std::vector<std::byte> out(compress_bound(codec, samples.size()));
  if (codec == Codec::zstd) {
    const std::size_t n = ZSTD_compress(out.data(), out.size(), samples.data(), samples.size(), 3);
    assert(!ZSTD_isError(n));
    out.resize(n);
  } else {
    const std::unique_ptr<libdeflate_compressor, FreeCompressor> compressor(libdeflate_alloc_compressor(6));
    out.resize(libdeflate_zlib_compress(compressor.get(), samples.data(), samples.size(), out.data(), out.size()));
  }
  return out;
}

/// Fills up to `bytes`: a Zstandard frame to skip, or what lies behind the end of a zlib stream.
/// Source: RFC 8878, 3.1.2, Skippable Frames.
void fill_up(Codec codec, std::uint64_t bytes, std::vector<std::byte>& out) {
  const std::size_t end = out.size();
  out.resize(bytes);
  if (codec != Codec::zstd || bytes < end + 8) return;
  const std::array<std::uint32_t, 2> frame = {0x184D2A50, static_cast<std::uint32_t>(bytes - end - 8)};
  std::memcpy(out.data() + end, frame.data(), sizeof frame);
}

/// A value as a sample of the type, which holds it.
void store(SampleType type, float value, std::byte* out) {
  const auto value8 = static_cast<std::uint8_t>(type == SampleType::u8 ? value : 0);
  const auto value16 = static_cast<std::uint16_t>(type == SampleType::u16 ? value : 0);
  switch (type) {
    case SampleType::u8:
      std::memcpy(out, &value8, 1);
      break;
    case SampleType::u16:
      std::memcpy(out, &value16, 2);
      break;
    case SampleType::f32:
      std::memcpy(out, &value, 4);
      break;
  }
}

tl::unexpected<Error> refuse(const std::string& name, const std::string& message) {
  return fail(Error::Kind::Unsupported, name + ": " + message);
}

}  // namespace

void rule_row(int level, int band, std::int64_t x0, std::int64_t y, std::size_t n, std::uint16_t* out) {
  std::vector<std::uint32_t> sum(n, 0);
  std::uint32_t hills = 0;
  for (const int period : {5, 10, 15, 20, 25}) {  // of level 0, as powers of two
    if (period - level < 2) continue;
    const auto plane = static_cast<std::uint64_t>(band) * 64 + static_cast<std::uint64_t>(period);
    add_hills(plane, period - level, x0, y, n, sum.data());
    ++hills;
  }
  const auto fine = static_cast<std::uint64_t>(band) * 64 + 32 + static_cast<std::uint64_t>(level);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t mean = hills > 0 ? sum[i] / hills : 32768;
    // 7/8 of at most 65535 and 1/8 of it
    out[i] = static_cast<std::uint16_t>(mean * 7 / 8 + noise(fine, x0 + static_cast<std::int64_t>(i), y) / 8);
  }
}

double rule_sample(SampleType type, int level, int band, std::int64_t x, std::int64_t y) {
  std::uint16_t value = 0;
  rule_row(level, band, x, y, 1, &value);
  return type == SampleType::u8 ? value >> 8 : type == SampleType::u16 ? value : value * 0x1p-16;
}

RepeatedContent::RepeatedContent(std::vector<float> texels, int side, int bands, bool whole)
    : side_(side), bands_(bands) {
  assert(std::has_single_bit(static_cast<unsigned>(side)) &&
         texels.size() == static_cast<std::size_t>(side) * static_cast<std::size_t>(side * bands));
  levels_.push_back(std::move(texels));
  for (std::size_t n = static_cast<std::size_t>(side) / 2; n > 0; n /= 2) {
    const std::vector<float>& finer = levels_.back();
    const auto b = static_cast<std::size_t>(bands);
    std::vector<float> mean(n * n * b);
    for (std::size_t y = 0; y < n; ++y)
      for (std::size_t i = 0; i < n * b; ++i) {
        const float* top = finer.data() + 4 * y * n * b + (i / b * 2) * b + i % b;
        const float* bottom = top + 2 * n * b;
        const float value = (top[0] + top[b] + bottom[0] + bottom[b]) / 4;
        mean[y * n * b + i] = whole ? std::floor(value + 0.5f) : value;
      }
    levels_.push_back(std::move(mean));
  }
}

Result<std::shared_ptr<const ProceduralTiff>> ProceduralTiff::make(const std::string& name, const MapRule& rule) {
  constexpr std::int64_t most = std::int64_t{1} << 30;
  if (rule.width < 1 || rule.height < 1 || rule.width > most || rule.height > most)
    return refuse(name, fmt::format("{} x {} texels; expected 1 to 2^30 each way", rule.width, rule.height));
  if (rule.bands < 1 || rule.bands > 16) return refuse(name, fmt::format("{} bands; expected 1 to 16", rule.bands));
  if (rule.tile_size < 16 || rule.tile_size > 4096 || rule.tile_size % 16 != 0)
    return refuse(name, fmt::format("tiles of {} texels; expected a multiple of 16 up to 4096", rule.tile_size));
  const bool metres =
      rule.epsg == 3857 || (rule.epsg > 32600 && rule.epsg <= 32760 && rule.epsg % 100 <= 60 && rule.epsg % 100 > 0);
  if (!metres && rule.epsg != 4326)
    return refuse(name,
                  fmt::format("EPSG:{}; expected 4326, 3857 or a UTM zone on WGS 84 (32601 to 32660, 32701 to 32760)",
                              rule.epsg));

  if (rule.content) {
    const std::int64_t period = rule.content->side();
    if (rule.content->bands() != rule.bands || period % rule.tile_size != 0 || rule.width % period != 0 ||
        rule.height % period != 0)
      return refuse(name,
                    fmt::format("content of {} bands that repeats after {} texels; expected {} bands, a period of "
                                "whole tiles of {} texels, and whole periods",
                                rule.content->bands(), period, rule.bands, rule.tile_size));
  }

  std::shared_ptr<ProceduralTiff> tiff(new ProceduralTiff(name, rule));
  const auto side = static_cast<std::uint64_t>(rule.tile_size);
  tiff->tile_bytes_ = side * side * static_cast<std::uint64_t>(rule.bands) * sample_bytes(rule.type);
  const std::size_t bound = compress_bound(rule.codec, tiff->tile_bytes_);
  tiff->place_bytes_ = rule.codec == Codec::none ? tiff->tile_bytes_ : align(bound, place_alignment);
  // All levels together have at most 4/3 of the tiles of the first, and one more each for their edges.
  const double tiles = (static_cast<double>(rule.width) / static_cast<double>(side) + 2) *
                       (static_cast<double>(rule.height) / static_cast<double>(side) + 2) * 4 / 3;
  if (tiles * static_cast<double>(tiff->place_bytes_ + 16) >= 0x1p63)
    return refuse(name,
                  "its file would take more than 2^63 bytes; make it smaller, or of fewer bands or smaller samples");
  tiff->lay_out();
  return tiff;
}

void ProceduralTiff::lay_out() {
  const std::int64_t side = rule_.tile_size;
  for (std::int64_t w = rule_.width, h = rule_.height;;
       w = std::max<std::int64_t>(w / 2, 1), h = std::max<std::int64_t>(h / 2, 1)) {
    const std::int64_t columns = (w + side - 1) / side, rows = (h + side - 1) / side;
    const std::int64_t repeat =
        rule_.content ? std::max<std::int64_t>((rule_.content->side() >> levels_.size()) / side, 1) : columns + rows;
    levels_.push_back({w, h, columns, rows, std::min(columns, repeat), std::min(rows, repeat)});
    if (w <= side && h <= side) break;
  }
  // Directories hold where indexes and tiles lie, and take as much room whatever that is.
  std::uint64_t at = align(head().size(), 16);
  for (Level& level : levels_) {
    level.offsets_at = at;
    level.counts_at = at + 8 * level.tiles();
    at = level.counts_at + 8 * level.tiles();
  }
  at = align(at, place_alignment);
  for (auto level = levels_.rbegin(); level != levels_.rend(); ++level) {
    level->tiles_at = at;
    at += place_bytes_ * level->stored_tiles();
  }
  size_ = at;
  head_ = head();
}

std::vector<std::byte> ProceduralTiff::head() const {
  const auto bands = static_cast<std::size_t>(rule_.bands);
  const bool rgb = rule_.bands >= 3 && rule_.type == SampleType::u8;
  const auto bits = static_cast<std::uint16_t>(8 * sample_bytes(rule_.type));
  const std::uint16_t format = rule_.type == SampleType::f32 ? 3 : 1;
  const std::uint16_t compression = rule_.codec == Codec::none ? 1 : rule_.codec == Codec::deflate ? 8 : 50000;
  const auto short_value = [](int value) { return std::vector<std::uint16_t>{static_cast<std::uint16_t>(value)}; };
  const auto long_value = [](std::int64_t value) {
    return std::vector<std::uint32_t>{static_cast<std::uint32_t>(value)};
  };
  const auto text = [](const std::string& value) {
    return std::vector<char>(value.c_str(), value.c_str() + value.size() + 1);
  };

  std::vector<std::byte> file(header_bytes);
  const std::array<std::uint16_t, 4> magic = {0x4949, 43, 8, 0};
  const std::uint64_t first = header_bytes;
  std::memcpy(file.data(), magic.data(), sizeof magic);
  std::memcpy(file.data() + 8, &first, sizeof first);

  std::uint64_t at = header_bytes;
  for (std::size_t k = 0; k < levels_.size(); ++k) {
    const Level& level = levels_[k];
    Directory d;
    if (k > 0) d.add(254, Directory::u32, long_value(1));  // NewSubfileType: a reduced image
    d.add(256, Directory::u32, long_value(level.width));
    d.add(257, Directory::u32, long_value(level.height));
    d.add(258, Directory::u16, std::vector<std::uint16_t>(bands, bits));
    d.add(259, Directory::u16, short_value(compression));
    d.add(262, Directory::u16, short_value(rgb ? 2 : 1));
    d.add(277, Directory::u16, short_value(rule_.bands));
    d.add(284, Directory::u16, short_value(1));  // bands of a texel together
    d.add(322, Directory::u32, long_value(rule_.tile_size));
    d.add(323, Directory::u32, long_value(rule_.tile_size));
    if (level.tiles() > 1) {
      d.add_elsewhere(324, level.tiles(), level.offsets_at);
      d.add_elsewhere(325, level.tiles(), level.counts_at);
    } else {  // a single value stands in the entry itself
      const bool laid_out = level.tiles_at != 0;
      d.add(324, Directory::u64, std::vector<std::uint64_t>{level.tiles_at});
      d.add(325, Directory::u64, std::vector<std::uint64_t>{laid_out ? byte_count({static_cast<int>(k), 0}) : 0});
    }
    const std::size_t extra = bands - (rgb ? 3 : 1);
    if (extra > 0) d.add(338, Directory::u16, std::vector<std::uint16_t>(extra, 0));
    d.add(339, Directory::u16, std::vector<std::uint16_t>(bands, format));
    if (rule_.texture) {  // PixarTextureFormat, PixarWrapModes
      d.add(33302, Directory::ascii, text("Plain Texture"));
      d.add(33303, Directory::ascii, text("clamp,clamp"));
    }
    if (k == 0) {
      const bool degrees = rule_.epsg == 4326;
      d.add(33550, Directory::f64, std::vector<double>{rule_.texel, rule_.texel, 0});
      d.add(33922, Directory::f64, std::vector<double>{0, 0, 0, rule_.west, rule_.north, 0});
      // GTModelType, GTRasterType (a texel is an area), GeographicType or ProjectedCSType
      d.add(34735, Directory::u16,
            std::vector<std::uint16_t>{1, 1, 0, 3, 1024, 0, 1, static_cast<std::uint16_t>(degrees ? 2 : 1), 1025, 0, 1,
                                       1, static_cast<std::uint16_t>(degrees ? 2048 : 3072), 0, 1,
                                       static_cast<std::uint16_t>(rule_.epsg)});
    }
    if (rule_.nodata) d.add(42113, Directory::ascii, text(fmt::format("{}", *rule_.nodata)));
    const std::uint64_t next = at + d.size();
    d.write(at, k + 1 < levels_.size() ? next : 0, file);
    at = next;
  }
  return file;
}

ProceduralTiff::Bytes ProceduralTiff::make_tile(TileId id) const {
  const Level& level = levels_[static_cast<std::size_t>(id.level)];
  const auto side = static_cast<std::size_t>(rule_.tile_size), bands = static_cast<std::size_t>(rule_.bands);
  const auto across = static_cast<std::uint64_t>(level.repeat_columns);
  const auto column = static_cast<std::int64_t>(id.index % across), row = static_cast<std::int64_t>(id.index / across);
  const std::int64_t x0 = column * rule_.tile_size, y0 = row * rule_.tile_size;

  std::vector<std::byte> samples(tile_bytes_);
  if (rule_.content) {
    std::byte* out = samples.data();
    for (std::size_t i = 0; i < side * side * bands; ++i, out += sample_bytes(rule_.type)) {
      const auto texel = static_cast<std::int64_t>(i / bands);
      store(rule_.type,
            rule_.content->at(id.level, static_cast<int>(i % bands), x0 + texel % rule_.tile_size,
                              y0 + texel / rule_.tile_size),
            out);
    }
    return packed_tile(id, std::move(samples));
  }
  std::vector<std::uint16_t> values(side);
  for (std::size_t y = 0; y < side; ++y)
    for (std::size_t band = 0; band < bands; ++band) {
      rule_row(id.level, static_cast<int>(band), x0, y0 + static_cast<std::int64_t>(y), side, values.data());
      std::byte* out = samples.data() + (y * side * bands + band) * sample_bytes(rule_.type);
      const std::size_t step = bands * sample_bytes(rule_.type);
      for (std::size_t x = 0; x < side; ++x, out += step) {
        const std::uint16_t value = values[x];
        store(rule_.type,
              rule_.type == SampleType::u8    ? static_cast<float>(value >> 8)
              : rule_.type == SampleType::u16 ? static_cast<float>(value)
                                              : static_cast<float>(value) * 0x1p-16f,
              out);
      }
    }
  return packed_tile(id, std::move(samples));
}

ProceduralTiff::Bytes ProceduralTiff::packed_tile(TileId id, std::vector<std::byte> samples) const {
  auto packed = compress(rule_.codec, std::move(samples));
  if (!rule_.exact_byte_counts) fill_up(rule_.codec, byte_count(id), packed);
  return std::make_shared<const std::vector<std::byte>>(std::move(packed));
}

ProceduralTiff::Bytes ProceduralTiff::tile(TileId id) const {
  {
    std::scoped_lock lock(mutex_);
    if (const auto found = places_.find(id); found != places_.end()) {
      kept_.splice(kept_.begin(), kept_, found->second);
      return found->second->bytes;
    }
  }
  // Two threads that want the same tile both make it: they get the same bytes.
  Bytes bytes = make_tile(id);
  std::scoped_lock lock(mutex_);
  if (places_.contains(id)) return bytes;
  kept_.push_front({id, bytes});
  places_[id] = kept_.begin();
  if (rule_.exact_byte_counts) counts_[id] = bytes->size();
  if (kept_.size() > kept_tiles) {
    places_.erase(kept_.back().id);
    kept_.pop_back();
  }
  return bytes;
}

std::uint64_t ProceduralTiff::byte_count(TileId id) const {
  if (rule_.codec == Codec::none) return tile_bytes_;
  if (!rule_.exact_byte_counts) return compress_bound(rule_.codec, tile_bytes_);
  {
    std::scoped_lock lock(mutex_);
    if (const auto found = counts_.find(id); found != counts_.end()) return found->second;
  }
  return tile(id)->size();
}

/// The entry of a level's index, of which the offsets come first and then the byte counts.
std::uint64_t ProceduralTiff::index_entry(const Level& level, std::uint64_t at) const {
  if (at < level.tiles()) return level.tiles_at + level.stored(at) * place_bytes_;
  return byte_count({static_cast<int>(&level - levels_.data()), level.stored(at - level.tiles())});
}

void ProceduralTiff::read_index(const Level& level, std::uint64_t begin, std::uint64_t offset,
                                std::span<std::byte> out) const {
  for (std::size_t done = 0; done < out.size();) {
    const std::uint64_t at = offset + done - begin;
    const std::uint64_t value = index_entry(level, at / 8);
    const std::size_t within = at % 8, n = std::min<std::size_t>(8 - within, out.size() - done);
    std::memcpy(out.data() + done, reinterpret_cast<const std::byte*>(&value) + within, n);
    done += n;
  }
}

void ProceduralTiff::read_tiles(int level, std::uint64_t offset, std::span<std::byte> out) const {
  const std::uint64_t begin = levels_[static_cast<std::size_t>(level)].tiles_at;
  for (std::size_t done = 0; done < out.size();) {
    const std::uint64_t at = offset + done - begin, within = at % place_bytes_;
    const std::size_t n = std::min<std::uint64_t>(place_bytes_ - within, out.size() - done);
    const Bytes bytes = tile({level, at / place_bytes_});
    const std::size_t there = within < bytes->size() ? std::min<std::size_t>(n, bytes->size() - within) : 0;
    if (there > 0) std::memcpy(out.data() + done, bytes->data() + within, there);
    std::fill_n(out.data() + done + there, n - there, std::byte{0});
    done += n;
  }
}

Result<void> ProceduralTiff::read(std::uint64_t offset, std::span<std::byte> out) const {
  if (offset > size_ || out.size() > size_ - offset)
    return fail(Error::Kind::Io, fmt::format("{}: {} bytes at {} were asked for, but it ends at byte {}", name_,
                                             out.size(), offset, size_));
  // The part of `out` that a piece of the file covers
  const auto part = [&](std::uint64_t begin, std::uint64_t end) -> std::pair<std::uint64_t, std::span<std::byte>> {
    const std::uint64_t from = std::max(begin, offset), to = std::min<std::uint64_t>(end, offset + out.size());
    if (from >= to) return {from, {}};
    return {from, out.subspan(from - offset, to - from)};
  };
  std::fill(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(part(0, levels_.back().tiles_at).second.size()),
            std::byte{0});
  if (const auto [from, to] = part(0, head_.size()); !to.empty())
    std::copy_n(head_.begin() + static_cast<std::ptrdiff_t>(from), to.size(), to.begin());
  for (const Level& level : levels_) {
    if (const auto [from, to] = part(level.offsets_at, level.counts_at + 8 * level.tiles()); !to.empty())
      read_index(level, level.offsets_at, from, to);
    if (const auto [from, to] = part(level.tiles_at, level.tiles_at + place_bytes_ * level.stored_tiles()); !to.empty())
      read_tiles(static_cast<int>(&level - levels_.data()), from, to);
  }
  return {};
}

Result<void> ProceduralTiff::write(const std::filesystem::path& path) const {
  std::error_code ignored;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), ignored);
  const auto temporary = temporary_name(path);
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  int problem = fd < 0 ? errno : 0;
  const auto put = [&](std::uint64_t at, std::span<const std::byte> bytes) {
    while (problem == 0 && !bytes.empty()) {
      const ssize_t n = ::pwrite(fd, bytes.data(), bytes.size(), static_cast<off_t>(at));
      if (n < 0) {
        if (errno != EINTR) problem = errno;
        continue;
      }
      at += static_cast<std::uint64_t>(n);
      bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
  };
  // Tiles first: the index that follows then knows their byte counts
  if (problem == 0 && ::ftruncate(fd, static_cast<off_t>(size_)) != 0) problem = errno;
  for (int k = 0; k < levels(); ++k) {
    const Level& level = levels_[static_cast<std::size_t>(k)];
    for (std::uint64_t i = 0; i < level.stored_tiles() && problem == 0; ++i)
      put(level.tiles_at + i * place_bytes_, *tile({k, i}));
  }
  std::vector<std::byte> block;
  for (std::uint64_t at = 0, end = levels_.back().tiles_at; at < end && problem == 0; at += block.size()) {
    block.resize(std::min<std::uint64_t>(1 << 20, end - at));
    if (const auto got = read(at, block); !got) return got;
    put(at, block);
  }
  if (fd >= 0 && ::close(fd) != 0 && problem == 0) problem = errno;
  if (problem != 0) {
    std::filesystem::remove(temporary, ignored);
    return fail(Error::Kind::Io, fmt::format("{}: writing failed: {}", path.string(), std::strerror(problem)));
  }
  return move_into_place(temporary, path);
}

Result<void> write_map(const std::filesystem::path& path, const MapRule& rule, bool force) {
  if (const auto free = refuse_to_overwrite(path, force); !free) return free;
  const auto tiff = ProceduralTiff::make(path.string(), rule);
  if (!tiff) return fail(tiff);
  return (*tiff)->write(path);
}

}  // namespace nadir::bench

#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "nadir/base/byte_source.h"

namespace nadir::bench {

enum class SampleType { u8, u16, f32 };
enum class Codec { none, deflate, zstd };

/// A square of texels with all its levels down to one texel, for maps that repeat it in both directions.
class RepeatedContent {
 public:
  /// `texels`: side * side * bands, bands interleaved, values that the maps' type holds. The side is a power of two.
  /// Each further level is the mean of 2 x 2 texels of the one before, in whole numbers (ties up) where `whole`.
  RepeatedContent(std::vector<float> texels, int side, int bands, bool whole);

  std::int64_t side() const { return side_; }
  int bands() const { return bands_; }
  float at(int level, int band, std::int64_t x, std::int64_t y) const {
    const std::int64_t side = std::max<std::int64_t>(side_ >> level, 1);  // a map may have more levels
    const std::int64_t texel = (y & (side - 1)) * side + (x & (side - 1));
    return levels_[std::min(static_cast<std::size_t>(level), levels_.size() - 1)]
                  [static_cast<std::size_t>(texel * bands_ + band)];
  }

 private:
  std::int64_t side_;
  int bands_;
  std::vector<std::vector<float>> levels_;
};

/// A map that follows a rule instead of a survey.
struct MapRule {
  std::int64_t width = 0, height = 0;  // texels, 1 to 2^30
  int bands = 3;                       // 1 to 16
  SampleType type = SampleType::u8;
  Codec codec = Codec::none;
  int tile_size = 256;                                  // a multiple of 16, at most 4096
  int epsg = 32633;                                     // of metres for 32601 to 32760 and 3857, of degrees for 4326
  double west = 500'000, north = 5'400'000, texel = 1;  // of the top-left corner, and a texel's side, in the CRS
  std::optional<double> nodata;                         // only declared: no texel avoids it
  /// The byte counts of tiles are what they take compressed. To know one means to compress the tile, so that reading a
  /// page of the index takes as long as writing its tiles. Else each tile is filled up to the same number of bytes,
  /// about that of its samples, behind the end of what the codec reads.
  bool exact_byte_counts = true;
  /// What the texels are, instead of the rule's hills: of as many bands, its side a multiple of the tiles'. Map sides
  /// are then multiples of that side. Equal tiles lie in the file once.
  std::shared_ptr<const RepeatedContent> content;
  bool texture = false;  // marked as Pixar's textures are, without which OpenImageIO does not look for levels
};

/// The texels (x0, y) to (x0 + n - 1, y) of a band (from 0) of a level, as 16-bit values: smooth hills of several sizes
/// with a fine texture of an eighth of the range on top. Levels show the same hills, less those that are finer than
/// four texels there. By integers only: the same bits everywhere. Samples of type u8 are the upper 8 bits, of f32 the
/// value times 2^-16.
void rule_row(int level, int band, std::int64_t x0, std::int64_t y, std::size_t n, std::uint16_t* out);

/// One of them, as a map of `type` stores it.
double rule_sample(SampleType type, int level, int band, std::int64_t x, std::int64_t y);

/// The bytes of a tiled BigTIFF with all its levels down to one tile, laid out as cloud-optimized ones are
/// (directories, tile indexes, then tiles from the coarsest level to the finest), that exists nowhere: what is read is
/// computed. Level k + 1 is half of level k, rounded down. Georeferenced in the rule's CRS. Thread-safe. Keeps the last
/// 256 tiles that were read, and all byte counts that were found.
class ProceduralTiff : public ByteSource {
 public:
  /// Unsupported where the rule is out of its ranges, or its file would not fit 2^63 bytes.
  static Result<std::shared_ptr<const ProceduralTiff>> make(const std::string& name, const MapRule& rule);

  const std::string& name() const override { return name_; }
  std::uint64_t size() const override { return size_; }
  /// Io where it ends beyond the last byte.
  Result<void> read(std::uint64_t offset, std::span<std::byte> out) const override;

  const MapRule& rule() const { return rule_; }
  int levels() const { return static_cast<int>(levels_.size()); }
  std::int64_t width(int level) const { return levels_[static_cast<std::size_t>(level)].width; }
  std::int64_t height(int level) const { return levels_[static_cast<std::size_t>(level)].height; }

  /// Writes the same bytes to a file, a hole wherever a tile takes less than its place.
  Result<void> write(const std::filesystem::path& path) const;

 private:
  struct Level {
    std::int64_t width, height, columns, rows;  // the latter two in tiles
    std::int64_t repeat_columns, repeat_rows;   // tiles after which they repeat: those that lie in the file
    std::uint64_t offsets_at = 0, counts_at = 0, tiles_at = 0;
    std::uint64_t tiles() const { return static_cast<std::uint64_t>(columns) * static_cast<std::uint64_t>(rows); }
    std::uint64_t stored_tiles() const {
      return static_cast<std::uint64_t>(repeat_columns) * static_cast<std::uint64_t>(repeat_rows);
    }
    /// Place among the stored tiles of one of the level's tiles.
    std::uint64_t stored(std::uint64_t tile) const {
      const auto across = static_cast<std::uint64_t>(columns), wide = static_cast<std::uint64_t>(repeat_columns);
      return tile / across % static_cast<std::uint64_t>(repeat_rows) * wide + tile % across % wide;
    }
  };
  struct TileId {
    int level;
    std::uint64_t index;  // among the stored ones, row by row
    friend auto operator<=>(const TileId&, const TileId&) = default;
  };
  using Bytes = std::shared_ptr<const std::vector<std::byte>>;

  ProceduralTiff(std::string name, const MapRule& rule) : name_(std::move(name)), rule_(rule) {}
  void lay_out();
  std::vector<std::byte> head() const;
  Bytes make_tile(TileId id) const;
  Bytes packed_tile(TileId id, std::vector<std::byte> samples) const;
  Bytes tile(TileId id) const;
  std::uint64_t byte_count(TileId id) const;
  std::uint64_t index_entry(const Level& level, std::uint64_t at) const;
  void read_index(const Level& level, std::uint64_t begin, std::uint64_t offset, std::span<std::byte> out) const;
  void read_tiles(int level, std::uint64_t offset, std::span<std::byte> out) const;

  const std::string name_;
  const MapRule rule_;
  std::vector<Level> levels_;
  std::uint64_t tile_bytes_ = 0, place_bytes_ = 0;  // of a tile's samples; from one tile's begin to the next one's
  std::uint64_t size_ = 0;
  std::vector<std::byte> head_;

  struct Kept {
    TileId id;
    Bytes bytes;
  };
  mutable std::mutex mutex_;      // guards what follows
  mutable std::list<Kept> kept_;  // the last used first
  mutable std::map<TileId, std::list<Kept>::iterator> places_;
  mutable std::map<TileId, std::uint64_t> counts_;
};

/// Writes the map of a rule to a file that GDAL reads. Exists where it is there and `force` is not set.
Result<void> write_map(const std::filesystem::path& path, const MapRule& rule, bool force = false);

}  // namespace nadir::bench

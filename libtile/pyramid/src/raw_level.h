#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "disk_file.h"
#include "levels.h"
#include "nadir/mosaic/block.h"
#include "reduction.h"

namespace nadir::pyramid {

/// A level as one stage hands it to the next: unpacked tiles on disk, those that hold data.
/// Thread-safe.
class RawLevel {
 public:
  RawLevel(const TexelType& type, const LevelPlan& plan, int level) : type_(type), plan_(plan), level_(level) {}

  /// Files that tiles lie in; the last added is the one that `store` appends to. Its index.
  Result<std::uint32_t> add_file(DiskFile file);

  /// Writes the tile (col, row) from `block`, which holds all of it. Where it lies in the file.
  Result<std::uint64_t> store(const Block& block, std::int32_t col, std::int32_t row);
  std::uint64_t tile_bytes(std::int32_t col, std::int32_t row) const;

  /// Makes a stored tile known, with the statistics of the level-0 texels under it.
  /// False where such a tile cannot lie there.
  bool add(std::int32_t col, std::int32_t row, std::uint32_t file, std::uint64_t offset,
           std::vector<BandStatistics> statistics);

  bool reaches(const Window& window) const;
  /// Fills `to`; what no tile holds is empty.
  Result<void> read(Block& to) const;
  /// Null where the tile holds no data.
  const std::vector<BandStatistics>* statistics(std::int32_t col, std::int32_t row) const;

 private:
  struct Tile {
    std::uint32_t file = 0;
    std::uint64_t offset = 0;
    std::vector<BandStatistics> statistics;
  };
  const Tile* find(std::int32_t col, std::int32_t row) const;
  TileRange tiles_under(const Window& window) const;
  Result<void> read_tile(const Tile& tile, const Window& tile_window, Block& to) const;

  TexelType type_;
  const LevelPlan& plan_;
  int level_;
  std::vector<DiskFile> files_;
  std::atomic<std::uint64_t> end_{0};              // of the last file
  mutable std::mutex mutex_;                       // guards tiles_
  std::unordered_map<std::uint64_t, Tile> tiles_;  // elements stay where they are
};

}  // namespace nadir::pyramid

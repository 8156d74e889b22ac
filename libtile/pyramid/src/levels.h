#pragma once

#include <cstdint>
#include <vector>

#include "nadir/pyramid/build.h"
#include "nadir/tile/map.h"

namespace nadir::pyramid {

using tile::Window;

/// Levels go on until both axes have at most so many texels, even where one tile would hold more: what is seen
/// from far above needs a level as coarse as its pixels, and these cost next to nothing.
constexpr std::int32_t coarsest_texels = 64;

/// Sizes of all levels, each half of the one before, rounded up.
std::vector<LevelSize> level_sizes(std::int32_t width, std::int32_t height);

/// Some levels, made together from the finest of them.
struct Stage {
  int first = 0, levels = 0;  // those whose tiles it packs
  bool hands_on = false;      // the level behind them is kept unpacked, and the next stage begins with it
};

/// A square of 2^depth x 2^depth tiles of a stage's first level and all that lies above them: what is made at once.
struct Chunk {
  std::int32_t col = 0, row = 0;
  friend auto operator<=>(const Chunk&, const Chunk&) = default;
};

/// Tiles of a level: columns and rows from (col, row) on.
struct TileRange {
  std::int32_t col = 0, row = 0, cols = 0, rows = 0;
  std::int64_t count() const { return std::int64_t{cols} * rows; }
};

/// How a pyramid is divided into work. What a level holds does not depend on it.
class LevelPlan {
 public:
  /// `depth`: levels a stage, at least 1.
  LevelPlan(const LevelSize& full, std::int32_t tile_size, int depth);

  const std::vector<LevelSize>& sizes() const { return sizes_; }
  std::int32_t tile_size() const { return tile_size_; }
  int depth() const { return depth_; }
  const std::vector<Stage>& stages() const { return stages_; }

  TileRange tiles(int level) const;
  Window level_window(int level) const;
  /// Chunks of a stage: columns and rows.
  TileRange chunks(const Stage& stage) const;
  /// Tiles of `level` that lie in a chunk; `level` from the stage's first on to the one it hands on.
  TileRange tiles_of(const Stage& stage, const Chunk& chunk, int level) const;
  /// Texels of tiles, clipped to their level.
  Window window_of(int level, const TileRange& tiles) const;

 private:
  std::vector<LevelSize> sizes_;
  std::int32_t tile_size_;
  int depth_;
  std::vector<Stage> stages_;
};

}  // namespace nadir::pyramid

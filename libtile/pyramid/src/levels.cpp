#include "levels.h"

#include <algorithm>

namespace nadir::pyramid {

std::vector<LevelSize> level_sizes(std::int32_t width, std::int32_t height) {
  std::vector<LevelSize> sizes = {{width, height}};
  while (std::max(width, height) > coarsest_texels) {
    width -= width / 2;
    height -= height / 2;
    sizes.push_back({width, height});
  }
  return sizes;
}

LevelPlan::LevelPlan(const LevelSize& full, std::int32_t tile_size, int depth)
    : sizes_(level_sizes(full.width, full.height)), tile_size_(tile_size), depth_(depth) {
  const int count = static_cast<int>(sizes_.size());
  for (int first = 0; first < count; first += depth)
    stages_.push_back({first, std::min(depth, count - first), first + depth < count});
}

TileRange LevelPlan::tiles(int level) const {
  const LevelSize& size = sizes_[static_cast<std::size_t>(level)];
  return {0, 0, (size.width - 1) / tile_size_ + 1, (size.height - 1) / tile_size_ + 1};
}

Window LevelPlan::level_window(int level) const {
  const LevelSize& size = sizes_[static_cast<std::size_t>(level)];
  return {0, 0, size.width, size.height};
}

TileRange LevelPlan::chunks(const Stage& stage) const {
  const TileRange all = tiles(stage.first);
  const auto squares = [&](std::int32_t count) { return ((count - 1) >> depth_) + 1; };
  return {0, 0, squares(all.cols), squares(all.rows)};
}

TileRange LevelPlan::tiles_of(const Stage& stage, const Chunk& chunk, int level) const {
  const int shift = stage.first + depth_ - level;
  const TileRange all = tiles(level);
  TileRange range;
  range.col = chunk.col << shift;
  range.row = chunk.row << shift;
  const std::int64_t side = std::int64_t{1} << shift;
  range.cols = static_cast<std::int32_t>(std::min(side, std::int64_t{all.cols} - range.col));
  range.rows = static_cast<std::int32_t>(std::min(side, std::int64_t{all.rows} - range.row));
  return range;
}

Window LevelPlan::window_of(int level, const TileRange& tiles) const {
  const LevelSize& size = sizes_[static_cast<std::size_t>(level)];
  const std::int32_t x = tiles.col * tile_size_, y = tiles.row * tile_size_;
  return {x, y,
          static_cast<std::int32_t>(std::min(std::int64_t{tiles.cols} * tile_size_, std::int64_t{size.width} - x)),
          static_cast<std::int32_t>(std::min(std::int64_t{tiles.rows} * tile_size_, std::int64_t{size.height} - y))};
}

}  // namespace nadir::pyramid

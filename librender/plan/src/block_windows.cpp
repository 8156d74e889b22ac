#include "block_windows.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace nadir::render {
namespace {

/// Turns of which a block across a map's two ends is counted: it starts in the third, and spans less than two more.
constexpr std::int32_t turns_counted = 5;

/// Brings a block to the third turn.
void count_turns(PlannedBlock& block, double map_width) {
  const double shift = (2 - std::floor(block.seen_min.x() / map_width)) * map_width;
  block.seen_min.x() += shift;
  block.seen_max.x() += shift;
  block.sampling.texel_origin.x() += shift;
  for (auto& p : block.texels) p.x() += shift;
  block.sampling.map_width = turns_counted * map_width;
}

}  // namespace

bool counts_turns(const tile::Map& map) {
  return map.goes_around() && map.width() < std::numeric_limits<std::int32_t>::max() / turns_counted;
}

std::int64_t find_windows(PlannedBlock& block, const tile::Map& map) {
  const BlockSampling& s = block.sampling;
  const auto [low, high] = std::minmax_element(s.level_at_corner.begin(), s.level_at_corner.end());
  const LevelBlend::Choice coarse = s.level_blend(*high);
  const int first = s.level_blend(*low).finer;
  const int last = std::min(coarse.finer + (coarse.coarser > 0), static_cast<int>(map.levels().size()) - 1);

  // Two texels to each side for the footprint of a cubic sample, one for a bilinear one, and one for what a step's
  // linear offsets miss
  const double margin = s.interpolation == Interpolation::Cubic ? 3 : 2;
  bool across = !block.windows.empty() && block.windows.front().around;
  if (!across && counts_turns(map)) {
    const double reach = margin * map.levels()[static_cast<std::size_t>(last)].texels_x;
    across = block.seen_min.x() < reach || block.seen_max.x() > map.width() - reach;
    if (across) count_turns(block, map.width());
  }
  block.windows.clear();
  std::int64_t cells = 0;
  for (int k = first; k <= last; ++k) {
    const tile::Level& level = map.levels()[static_cast<std::size_t>(k)];
    const auto cell_of = [](double texel, std::int32_t size) {
      return static_cast<std::int32_t>(std::clamp(std::floor(texel), 0.0, size - 1.0)) >> tile::cell_size_log2;
    };
    LevelWindow window{k, level.texels_x, level.texels_y, level.width, level.height};
    window.around = across;
    const std::int32_t width = across ? turns_counted * level.width : level.width;
    window.first_col = cell_of(block.seen_min.x() / level.texels_x - margin, width);
    window.first_row = cell_of(block.seen_min.y() / level.texels_y - margin, level.height);
    window.cols = cell_of(block.seen_max.x() / level.texels_x + margin, width) - window.first_col + 1;
    window.rows = cell_of(block.seen_max.y() / level.texels_y + margin, level.height) - window.first_row + 1;
    const std::int32_t shared = across ? 2 : 0;  // stored cells at the ends of the row, and the last column's
    cells += static_cast<std::int64_t>(window.cols + shared) * window.rows;
    block.windows.push_back(window);
  }
  return cells;
}

void coarsen(PlannedBlock& block, const tile::Map& map) {
  const int finest = block.windows.front().level + 1;
  assert(finest < static_cast<int>(map.levels().size()));
  for (double& level : block.sampling.level_at_corner) level = std::max(level, static_cast<double>(finest));
  find_windows(block, map);
}

}  // namespace nadir::render

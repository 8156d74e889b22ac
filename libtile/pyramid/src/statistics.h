#pragma once

#include <cstdint>
#include <vector>

#include "nadir/mosaic/block.h"

namespace nadir::pyramid {

using mosaic::Block;
using mosaic::TexelType;
using tile::Window;

/// Of the valid samples of one band.
struct BandStatistics {
  std::uint64_t count = 0;
  double minimum = 0, maximum = 0;  // 0 where count is 0
  double mean = 0;
  double sum_of_squares = 0;  // of differences from the mean

  /// Adds what was counted elsewhere. The order of additions decides the last bits.
  void add(const BandStatistics& other);
};

/// Statistics of each data band over the window `window` of `block`.
std::vector<BandStatistics> statistics(const TexelType& type, const Block& block, const Window& window);

/// Whether no texel of `window` holds data: all are masked, transparent, or nodata in all data bands.
bool empty(const TexelType& type, const Block& block, const Window& window);

}  // namespace nadir::pyramid

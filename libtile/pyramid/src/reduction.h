#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nadir/mosaic/block.h"
#include "nadir/pyramid/build.h"

namespace nadir::pyramid {

using mosaic::Block;
using mosaic::TexelType;
using tile::Window;

/// How a level is made from the one before.
struct Reduction {
  Filter filter = Filter::Box;
  bool power = false;                 // data bands are decibels, and averaged as the power they stand for
  std::vector<double> scale, offset;  // a data band's decibels = sample * scale + offset; empty: 1, 0
};

/// Makes windows of one level from those of the level before, whose size is twice its own, or one less.
///
/// Both levels span the same ground, so that a texel of the coarser one covers fractions where a size is odd and the
/// far edge stays. What is invalid (masked, nodata, NaN, infinite) has no part in a mean; colours are weighted by
/// alpha; where nothing is valid the result is invalid. Integers are rounded to nearest, ties to even, and never onto
/// nodata. A texel depends on the samples it covers alone, not on the window it is made in: any division of a level
/// into windows, and any kernel that the CPU has, gives the same bits.
/// Thread-safe.
class Reducer {
 public:
  Reducer(const TexelType& type, const Reduction& reduction, LevelSize fine, LevelSize coarse);

  /// Texels of the finer level that the window `coarse` needs, clipped to the level.
  Window needed(const Window& coarse) const;

  /// Texels of the coarser level in which the centres of the window `fine` lie.
  Window parents(const Window& fine) const;

  /// Fills `coarse` from `fine`, which holds at least needed(coarse.window()).
  void reduce(const Block& fine, Block& coarse) const;

  /// What the window `tile` of `fine` loses: for each data band the root of the mean square of the difference between
  /// a valid texel and the texel of `coarse` in which its centre lies, in stored units (power: decibels as stored); 0
  /// where none is valid. `coarse` holds at least parents(tile). `loss`: one for each data band.
  void loss(const Block& fine, const Window& tile, const Block& coarse, std::span<float> loss) const;

 private:
  TexelType type_;
  Reduction reduction_;
  LevelSize fine_, coarse_;
};

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

/// Whether no texel of `window` holds data (all masked, transparent, or nodata in all data bands).
bool empty(const TexelType& type, const Block& block, const Window& window);

}  // namespace nadir::pyramid

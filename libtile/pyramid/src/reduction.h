#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nadir/pyramid/build.h"
#include "statistics.h"

namespace nadir::pyramid {

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
/// alpha; where nothing is valid the texel is as mosaic::clear makes it. Integers are rounded to nearest, halves up,
/// and never onto nodata.
/// Error of a mean: half a step of an integer type, and no more (of 32 bits on odd sizes: and 2^-19 of a step).
/// A texel depends on the samples it is made from alone, not on the window it is made in: any division of a level into
/// windows, and any kernel, gives the same bits.
///
/// Box: the mean by area. Gaussian: standard deviation of 1/2 coarser texel, cut off at 3/2. Lanczos: of radius 3;
/// overshoot ends with the type. Both over what is valid, and only where the box holds something valid; where gaps
/// leave negative weights more than a third of the positive ones, the box's mean. Nearest: the texel that holds the
/// centre, of two the lower one. Mode: the value with the greatest valid area, of equals the least; opacity is averaged
/// by area nevertheless. Thread-safe.
class Reducer {
 public:
  Reducer(const TexelType& type, const Reduction& reduction, LevelSize fine, LevelSize coarse)
      : type_(type), reduction_(reduction), fine_(fine), coarse_(coarse) {}

  /// Texels of the finer level that the window `coarse` needs.
  Window needed(const Window& coarse) const;

  /// Texels of the coarser level in which the centres of the window `fine` lie.
  Window parents(const Window& fine) const;

  /// Fills `coarse` from `fine`, which holds at least needed(coarse.window()).
  void reduce(const Block& fine, Block& coarse) const;

  /// What the window `tile` of `fine` loses: for each data band the root of the mean square of the difference between
  /// a valid texel and the texel of `coarse` in which its centre lies, in stored units (decibels too); 0 where none is
  /// valid. `coarse` holds at least parents(tile). `loss`: one for each data band.
  /// By the box filter on even sizes, squares of losses of levels add up to that of level 0 towards the last.
  void loss(const Block& fine, const Window& tile, const Block& coarse, std::span<float> loss) const;

 private:
  TexelType type_;
  Reduction reduction_;
  LevelSize fine_, coarse_;
};

}  // namespace nadir::pyramid

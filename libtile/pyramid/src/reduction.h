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

/// The samples along one axis of the finer level that one sample of the coarser comes from.
struct Taps {
  std::int32_t first = 0;
  std::vector<double> weights;  // sum 1
};

/// Taps of the coarser level's samples from `begin` to `end`; both levels span the same ground.
std::vector<Taps> taps(Filter filter, std::int32_t fine, std::int32_t coarse, std::int32_t begin, std::int32_t end);

/// Makes windows of one level from those of the level before, whose size is twice its own, or one less.
///
/// Both levels span the same ground, so that a texel of the coarser one covers fractions where a size is odd and the
/// far edge stays. What is invalid (masked, nodata, NaN, infinite) has no part in a mean; colours are weighted by
/// alpha; where nothing is valid the texel is as mosaic::clear makes it. Integers are rounded to nearest, halves up,
/// and never onto nodata.
/// A texel depends on the samples it is made from alone, not on the window it is made in: any division of a level into
/// windows, and any kernel, gives the same bits.
/// Thread-safe.
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
  bool is_plain_box() const;

  TexelType type_;
  Reduction reduction_;
  LevelSize fine_, coarse_;
};

}  // namespace nadir::pyramid

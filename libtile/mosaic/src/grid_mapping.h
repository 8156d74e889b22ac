#pragma once

#include <array>
#include <vector>

#include "exact_mapping.h"
#include "nadir/mosaic/block.h"

namespace nadir::mosaic {

/// A rectangle of target texels, and where in the source they lie.
struct Patch {
  Window rect;
  Eigen::Vector2d corner, per_column, per_row, twist;  // texels of the source
  std::array<int, 2> samples = {1, 1};                 // along columns and rows, that make up one texel

  /// The place in the source `column` and `row` texels right of and below the rectangle's corner.
  Eigen::Vector2d source(double column, double row) const {
    return corner + row * per_row + column * (per_column + row * twist);
  }
};

/// Target texels to source texels within a tolerance: bilinear inside patches of at most `block_texels` a side, which
/// lie at multiples of that and are quartered until they meet the tolerance. A patch depends on both grids alone, not
/// on the window that asks for it. Thread-safe.
class GridMapping {
 public:
  static constexpr std::int32_t block_texels = 256;
  static constexpr int most_samples = 8;  // along an axis of a texel

  GridMapping(const Grid& target, const Grid& source, double tolerance_texels);

  const ExactMapping& exact() const { return exact_; }

  /// The patches that meet `window`, which lies within the target; those that certainly miss the source are left out.
  /// What is defined nowhere has no patch.
  std::vector<Patch> patches(const Window& window) const;

 private:
  void add(const Window& rect, const Window& window, std::vector<Patch>& patches) const;

  ExactMapping exact_;
  Window target_;
  Eigen::AlignedBox2d source_;
  double tolerance_texels_;
};

/// Texels common to both; width and height are 0 where there are none.
Window intersection(const Window& a, const Window& b);

}  // namespace nadir::mosaic

#pragma once

#include <Eigen/Geometry>

#include "kernels.h"
#include "nadir/render/pixel_rect.h"
#include "nadir/render/sample_block.h"

namespace nadir::render {

/// Pixels of a block, counted from its corner.
using Part = PixelRect;

/// Offsets within a pixel, from its corner: a grid of samples spans them.
struct SampleSpan {
  Eigen::Vector2d first, last;
};

/// Where a block's samples lie, in level-0 texels from `origin`.
class BlockGeometry {
 public:
  explicit BlockGeometry(const BlockSampling& block) : block_(block) {}

  Eigen::Vector2d origin() const { return given() ? Eigen::Vector2d(0, 0) : block_.texel_origin; }

  /// Of pixels x, x + 1, ... of row y, `offset` from their corners. `u`, `v`: of row_px, each.
  void row(const Kernels& kernels, int x, int y, int count, const Eigen::Vector2d& offset, double* u, double* v) const;

  /// What samples that lie `span` from their pixels' corners touch. Empty where none does, perhaps not finite.
  Eigen::AlignedBox2d bounds(const Part& part, const SampleSpan& span) const;

 private:
  bool given() const { return !block_.texels.empty(); }
  const Eigen::Vector2d& given_at(int x, int y) const {
    return block_
        .texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(block_.width) + static_cast<std::size_t>(x)];
  }
  RowPath path(double y) const;

  const BlockSampling& block_;
};

}  // namespace nadir::render

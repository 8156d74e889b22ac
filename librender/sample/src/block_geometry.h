#pragma once

#include <Eigen/Geometry>
#include <optional>

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

/// Texels, in a row of pixels: (t0 + x (t1 + x t2)) / (w.x + x w.y). As pairs and not as eight numbers, for it is read
/// as it was written: a processor that must put two numbers together which have only just been written waits until all
/// pixels written before them have left for memory, a fifth of a large frame.
struct TexelPath {
  Eigen::Vector2d t0{0, 0}, t1{0, 0}, t2{0, 0}, w{1, 0};

  RowPath numbers() const { return {t0.x(), t1.x(), t2.x(), t0.y(), t1.y(), t2.y(), w.x(), w.y()}; }
};

/// Where a block's samples lie, in level-0 texels from `origin`.
class BlockGeometry {
 public:
  explicit BlockGeometry(const BlockSampling& block) : block_(block) {}

  Eigen::Vector2d origin() const { return given() ? Eigen::Vector2d(0, 0) : block_.texel_origin; }

  /// Whether rows have a path; each pixel's texels are given otherwise.
  bool has_paths() const { return !given(); }
  /// Of the row whose points lie `y` from the block's upper edge; x counts from its left edge.
  TexelPath path(double y) const;
  /// Otherwise: of pixels x, x + 1, ... of row y, `offset` from their corners. `u`, `v`: of row_px, each.
  void given_row(int x, int y, int count, const Eigen::Vector2d& offset, double* u, double* v) const;

  /// What samples that lie `span` from their pixels' corners touch. Empty where none does, perhaps not finite.
  Eigen::AlignedBox2d bounds(const Part& part, const SampleSpan& span) const;

 private:
  bool given() const { return !block_.texels.empty(); }
  const Eigen::Vector2d& given_at(int x, int y) const {
    return block_
        .texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(block_.width) + static_cast<std::size_t>(x)];
  }
  const BlockSampling& block_;
};

/// A row of pixels about its middle: texels middle + d (slope + d bend) / (1 + d turn), d counting pixels from there.
struct RowMiddle {
  Eigen::Vector2d texel{0, 0}, slope{0, 0}, bend{0, 0};
  double turn = 0;
  double half = 0;     // greatest d of a pixel's centre
  bool gentle = true;  // no pole near, and all of it numbers
};
/// Of `count` pixels, the first one's centre at `first`.
RowMiddle middle_of(const TexelPath& path, double first, int count);

/// Points a pixel apart in a patch, the first of them `first` from the first pixel's centre, the last within half a
/// pixel of the last one's. Empty where single precision would not do.
std::optional<PatchRow> patch_row(const RowMiddle& middle, double first, const PatchFrame& frame);

}  // namespace nadir::render

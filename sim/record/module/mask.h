#pragma once

#include <span>
#include <vector>

#include "nadir/record/pictures.h"

namespace nadir::record {

/// How much of each pixel of a rectangle a shape covers, 0 to 1: what lines, areas and text become before they are
/// painted.
struct Mask {
  Rectangle box;
  std::vector<float> coverage;  // rows of box.width; empty where nothing is covered

  Mask() = default;
  explicit Mask(Rectangle area);
  float* row(int y) {
    return coverage.data() + static_cast<std::size_t>(y - box.y) * static_cast<std::size_t>(box.width);
  }
  const float* row(int y) const { return const_cast<Mask*>(this)->row(y); }
};

/// A line `width_px` wide with round joins and ends through `points`, inside `clip`. A single point gives a disc.
/// Each pixel is covered once, so a line that crosses itself has an even tone.
Mask line(std::span<const PicturePoint> points, bool closed, double width_px, Rectangle clip);

/// What lies inside the closed outline (even-odd rule), inside `clip`. Nothing where a point is not finite.
Mask area(std::span<const PicturePoint> outline, Rectangle clip);

/// The mask with its edge moved outwards by `radius_px`.
Mask grown(const Mask& mask, double radius_px);

}  // namespace nadir::record

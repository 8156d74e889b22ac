#include "block_geometry.h"

#include <cmath>

#include "nadir/render/homography.h"

namespace nadir::render {

void BlockGeometry::set_path(double y, RowPath& path) const {
  if (!block_.biquadratic) {
    const Eigen::Matrix3d& h = block_.texel_from_image;
    path.u0 = h(0, 1) * y + h(0, 2);
    path.u1 = h(0, 0);
    path.v0 = h(1, 1) * y + h(1, 2);
    path.v1 = h(1, 0);
    path.w0 = h(2, 1) * y + h(2, 2);
    path.w1 = h(2, 0);
    path.u2 = path.v2 = 0;
    return;
  }
  const std::array<Eigen::Vector2d, 3> terms = block_.biquadratic->row(y);
  path.u0 = terms[0].x();
  path.v0 = terms[0].y();
  path.u1 = terms[1].x();
  path.v1 = terms[1].y();
  path.u2 = terms[2].x();
  path.v2 = terms[2].y();
  path.w0 = 1;
  path.w1 = 0;
}

void BlockGeometry::given_row(int x, int y, int count, const Eigen::Vector2d& offset, double* u, double* v) const {
  const Eigen::Vector2d from_centre = block_.jacobian * (offset - Eigen::Vector2d(0.5, 0.5));
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d texel = given_at(x + i, y) + from_centre;
    u[i] = texel.x();
    v[i] = texel.y();
  }
}

std::optional<PatchRow> patch_row(const RowPath& path, double first, int count, const PatchFrame& frame) {
  const double half = (count - 1) / 2.0, middle = first + half;
  const double w = path.w0 + middle * path.w1, turn = path.w1 / w;
  constexpr double most_turn = 0.5, most_col = 1 << 15;
  bool fits = std::abs(turn) * half <= most_turn;  // false where it is not a number
  struct Axis {
    std::int32_t whole;
    float fraction, slope, bend;
  };
  const auto axis = [&](double a, double b, double c, double scale, double offset) {
    const double value = (a + middle * (b + middle * c)) / w;
    const double slope = ((b + 2 * middle * c) / w - value * turn) * scale, bend = c / w * scale;
    const double at = value * scale + offset;
    fits = fits && half * (std::abs(slope) + half * std::abs(bend)) <= most_from_middle * (1 - most_turn) &&
           std::abs(at) < most_col;
    if (!fits) return Axis{};
    const double whole = std::floor(at);
    return Axis{static_cast<std::int32_t>(whole), static_cast<float>(at - whole), static_cast<float>(slope),
                static_cast<float>(bend)};
  };
  const Axis x = axis(path.u0, path.u1, path.u2, frame.scale_x, frame.offset_x);
  const Axis y = axis(path.v0, path.v1, path.v2, frame.scale_y, frame.offset_y);
  if (!fits) return std::nullopt;
  return PatchRow{x.whole,
                  y.whole,
                  x.fraction,
                  y.fraction,
                  x.slope,
                  y.slope,
                  x.bend,
                  y.bend,
                  static_cast<float>(turn),
                  static_cast<float>(-half)};
}

Eigen::AlignedBox2d BlockGeometry::bounds(const Part& part, const SampleSpan& span) const {
  Eigen::AlignedBox2d box;
  if (given()) {
    for (int y = part.y; y < part.y + part.height; ++y)
      for (int x = part.x; x < part.x + part.width; ++x)
        if (const Eigen::Vector2d& texel = given_at(x, y); texel.allFinite()) box.extend(texel);
    if (box.isEmpty()) return box;
    Eigen::AlignedBox2d offsets;
    for (const double x : {span.first.x(), span.last.x()})
      for (const double y : {span.first.y(), span.last.y()})
        offsets.extend(block_.jacobian * Eigen::Vector2d(x - 0.5, y - 0.5));
    return {box.min() + offsets.min(), box.max() + offsets.max()};
  }
  const Eigen::Vector2d low = Eigen::Vector2d(part.x, part.y) + span.first;
  const Eigen::Vector2d high = Eigen::Vector2d(part.x + part.width - 1, part.y + part.height - 1) + span.last;
  if (!block_.biquadratic) {  // a homography keeps the outline's corners outermost
    for (const double x : {low.x(), high.x()})
      for (const double y : {low.y(), high.y()}) box.extend(apply(block_.texel_from_image, {x, y}));
    return box;
  }
  // Between lattice points a quadratic leaves their bounds by an eighth of its second difference at most
  for (const double x : {low.x(), (low.x() + high.x()) / 2, high.x()})
    for (const double y : {low.y(), (low.y() + high.y()) / 2, high.y()}) box.extend((*block_.biquadratic)({x, y}));
  const Eigen::Vector2d bulge = box.sizes() / 4;
  return {box.min() - bulge, box.max() + bulge};
}

}  // namespace nadir::render

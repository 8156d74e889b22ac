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

constexpr double most_turn = 0.5;  // of a row's half
constexpr double beyond = 17;      // pixels, which vectors take past a row's end

void set_middle(const RowPath& path, double first, int count, RowMiddle& middle) {
  const double half = (count - 1) / 2.0, at = first + half;
  const double over_w = 1 / (path.w0 + at * path.w1), turn = path.w1 * over_w;
  middle.turn = turn;
  middle.half = half;
  middle.u = (path.u0 + at * (path.u1 + at * path.u2)) * over_w;
  middle.v = (path.v0 + at * (path.v1 + at * path.v2)) * over_w;
  middle.slope_u = (path.u1 + 2 * at * path.u2) * over_w - middle.u * turn;
  middle.slope_v = (path.v1 + 2 * at * path.v2) * over_w - middle.v * turn;
  middle.bend_u = path.u2 * over_w;
  middle.bend_v = path.v2 * over_w;
  middle.gentle = std::abs(turn) * (half + beyond) <= most_turn;  // false where it is not a number
}

std::optional<PatchRow> patch_row(const RowMiddle& middle, double first, const PatchFrame& frame) {
  constexpr double most_col = 1 << 15;
  const double x = middle.u * frame.scale_x + frame.offset_x, y = middle.v * frame.scale_y + frame.offset_y;
  const double reach = middle.half + 0.5;
  const auto way = [&](double slope, double bend, double scale) {
    return reach * (std::abs(slope) + reach * std::abs(bend)) * scale;
  };
  const bool fits = middle.gentle && std::abs(x) < most_col && std::abs(y) < most_col &&
                    way(middle.slope_u, middle.bend_u, frame.scale_x) <= most_from_middle * (1 - most_turn) &&
                    way(middle.slope_v, middle.bend_v, frame.scale_y) <= most_from_middle * (1 - most_turn);
  if (!fits) return std::nullopt;
  const auto col = static_cast<std::int32_t>(std::floor(x)), row = static_cast<std::int32_t>(std::floor(y));
  return PatchRow{col,
                  row,
                  static_cast<float>(x - col),
                  static_cast<float>(y - row),
                  static_cast<float>(middle.slope_u * frame.scale_x),
                  static_cast<float>(middle.slope_v * frame.scale_y),
                  static_cast<float>(middle.bend_u * frame.scale_x),
                  static_cast<float>(middle.bend_v * frame.scale_y),
                  static_cast<float>(middle.turn),
                  static_cast<float>(first - middle.half)};
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

#include "block_geometry.h"

#include <cmath>

#include "nadir/render/homography.h"

namespace nadir::render {

TexelPath BlockGeometry::path(double y) const {
  if (block_.biquadratic) {
    const std::array<Eigen::Vector2d, 3> terms = block_.biquadratic->row(y);
    return {terms[0], terms[1], terms[2]};
  }
  const Eigen::Matrix3d& h = block_.texel_from_image;
  return {h.col(1).head<2>() * y + h.col(2).head<2>(), h.col(0).head<2>(), {0, 0}, {h(2, 1) * y + h(2, 2), h(2, 0)}};
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

RowMiddle middle_of(const TexelPath& path, double first, int count) {
  const double half = (count - 1) / 2.0, at = first + half;
  const double over_w = 1 / (path.w.x() + at * path.w.y()), turn = path.w.y() * over_w;
  const Eigen::Vector2d texel = (path.t0 + at * (path.t1 + at * path.t2)) * over_w;
  return {.texel = texel,
          .slope = (path.t1 + (2 * at) * path.t2) * over_w - texel * turn,
          .bend = path.t2 * over_w,
          .turn = turn,
          .half = half,
          .gentle = std::abs(turn) * (half + beyond) <= most_turn};  // false where it is not a number
}

std::optional<PatchRow> patch_row(const RowMiddle& middle, double first, const PatchFrame& frame) {
  constexpr double most_texels = 1 << 15;
  const Eigen::Array2d scale(frame.scale_x, frame.scale_y), offset(frame.offset_x, frame.offset_y);
  const Eigen::Array2d texel = middle.texel.array() * scale + offset;
  const double reach = middle.half + 0.5;
  const Eigen::Array2d way = reach * (middle.slope.array().abs() + reach * middle.bend.array().abs()) * scale;
  const bool fits =
      middle.gentle && (texel.abs() < most_texels).all() && (way <= most_from_middle * (1 - most_turn)).all();
  if (!fits) return std::nullopt;
  const auto col = static_cast<std::int32_t>(std::floor(texel.x())),
             row = static_cast<std::int32_t>(std::floor(texel.y()));
  return PatchRow{col,
                  row,
                  static_cast<float>(texel.x() - col),
                  static_cast<float>(texel.y() - row),
                  static_cast<float>(middle.slope.x() * frame.scale_x),
                  static_cast<float>(middle.slope.y() * frame.scale_y),
                  static_cast<float>(middle.bend.x() * frame.scale_x),
                  static_cast<float>(middle.bend.y() * frame.scale_y),
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

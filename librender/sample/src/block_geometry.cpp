#include "block_geometry.h"

#include "nadir/render/homography.h"

namespace nadir::render {

RowPath BlockGeometry::path(double y) const {
  if (!block_.biquadratic) {
    const Eigen::Matrix3d& h = block_.texel_from_image;
    return {h(0, 1) * y + h(0, 2), h(0, 0), 0, h(1, 1) * y + h(1, 2), h(1, 0), 0, h(2, 1) * y + h(2, 2), h(2, 0)};
  }
  // Along a row it is quadratic: through three of its points
  const double w = block_.width;
  const auto at = [&](double x) { return (*block_.biquadratic)(Eigen::Vector2d(x, y)); };
  const Eigen::Vector2d a = at(0), b = at(w / 2), c = at(w);
  const Eigen::Vector2d slope = (4 * b - 3 * a - c) / w, bend = 2 * (a - 2 * b + c) / (w * w);
  return {a.x(), slope.x(), bend.x(), a.y(), slope.y(), bend.y(), 1, 0};
}

void BlockGeometry::row(const Kernels& kernels, int x, int y, int count, const Eigen::Vector2d& offset, double* u,
                        double* v) const {
  if (!given()) {
    kernels.project(path(y + offset.y()), x + offset.x(), count, u, v);
    return;
  }
  const Eigen::Vector2d from_centre = block_.jacobian * (offset - Eigen::Vector2d(0.5, 0.5));
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d texel = given_at(x + i, y) + from_centre;
    u[i] = texel.x();
    v[i] = texel.y();
  }
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

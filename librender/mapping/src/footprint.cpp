#include "nadir/render/footprint.h"

namespace nadir::render {
namespace {

/// The polygon's part where visibility is positive; its cut lies just inside.
std::vector<Eigen::Vector2d> clip_at_horizon(const ExactChain& chain, const std::vector<Eigen::Vector2d>& polygon) {
  std::vector<Eigen::Vector2d> clipped;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double va = chain.visibility(a), vb = chain.visibility(b);
    if (va > 0) clipped.push_back(a);
    if ((va > 0) != (vb > 0)) {
      const double inside = 1e-9;
      const double s = va / (va - vb);
      clipped.push_back(a + (b - a) * (va > 0 ? s * (1 - inside) : s + (1 - s) * inside));
    }
  }
  return clipped;
}

}  // namespace

Footprint footprint(const ExactChain& chain, const geodesy::Projection& projection) {
  const double w = chain.camera().width_px(), h = chain.camera().height_px();
  const std::vector<Eigen::Vector2d> rectangle = {{0, 0}, {w, 0}, {w, h}, {0, h}};
  std::array<Eigen::Vector2d, 4> plane, lon_lat;
  chain.plane_from_image(rectangle, plane);
  chain.lon_lat_from_image(rectangle, lon_lat);
  std::array<Eigen::Vector2d, 4> crs = lon_lat;
  projection.crs_from_lon_lat(crs);

  Footprint result;
  for (std::size_t i = 0; i < 4; ++i)
    if (plane[i].allFinite())
      result.corners[i] = GroundPoint{{plane[i].x(), plane[i].y(), chain.plane().up_m()}, lon_lat[i], crs[i]};

  const auto polygon = clip_at_horizon(chain, rectangle);
  constexpr int points_a_side = 16;
  std::vector<Eigen::Vector2d> dense;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    for (int k = 0; k < points_a_side; ++k)
      dense.push_back(polygon[i] +
                      (polygon[(i + 1) % polygon.size()] - polygon[i]) * (static_cast<double>(k) / points_a_side));
  std::vector<Eigen::Vector2d> outline(dense.size());
  chain.lon_lat_from_image(dense, outline);
  for (const auto& p : outline)
    if (p.allFinite()) result.outline_lon_lat_rad.push_back(p);
  return result;
}

}  // namespace nadir::render

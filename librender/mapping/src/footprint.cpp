#include "nadir/render/footprint.h"

#include <algorithm>

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

constexpr int points_a_side = 16;

std::vector<Eigen::Vector2d> densified(const std::vector<Eigen::Vector2d>& polygon) {
  std::vector<Eigen::Vector2d> dense;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    for (int k = 0; k < points_a_side; ++k)
      dense.push_back(polygon[i] +
                      (polygon[(i + 1) % polygon.size()] - polygon[i]) * (static_cast<double>(k) / points_a_side));
  return dense;
}

/// An image point that sees ground, amid those on a grid that do: what is seen is convex in the image of an ideal lens,
/// and nearly so through others.
std::optional<Eigen::Vector2d> middle_of_ground(const ExactChain& chain, double w, double h) {
  constexpr int steps = 16;
  std::vector<Eigen::Vector2d> seen;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int j = 0; j <= steps; ++j)
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector2d at(w * i / steps, h * j / steps);
      if (!(chain.visibility(at) > 0)) continue;
      seen.push_back(at);
      sum += at;
    }
  if (seen.empty()) {
    // The Earth far away, between the grid's points
    const auto down = chain.camera().image_of(chain.down());
    const bool within = down && (down->array() >= 0).all() && down->x() <= w && down->y() <= h;
    return within && chain.visibility(*down) > 0 ? down : std::nullopt;
  }
  const Eigen::Vector2d middle = sum / static_cast<double>(seen.size());
  if (chain.visibility(middle) > 0) return middle;
  return *std::min_element(seen.begin(), seen.end(), [&](const auto& a, const auto& b) {
    return (a - middle).squaredNorm() < (b - middle).squaredNorm();
  });
}

/// The image's outline, and where it sees no ground the last place on the way to it from the middle that does.
std::vector<Eigen::Vector2d> drawn_in_to_ground(const ExactChain& chain,
                                                const std::vector<Eigen::Vector2d>& rectangle) {
  const auto middle = middle_of_ground(chain, rectangle[2].x(), rectangle[2].y());
  if (!middle) return {};
  std::vector<Eigen::Vector2d> outline = densified(rectangle);
  for (Eigen::Vector2d& p : outline) {
    if (chain.visibility(p) > 0) continue;
    Eigen::Vector2d ground = *middle, sky = p;
    for (int i = 0; i < 40; ++i) {
      const Eigen::Vector2d between = (ground + sky) / 2;
      (chain.visibility(between) > 0 ? ground : sky) = between;
    }
    p = ground;
  }
  return outline;
}

}  // namespace

Footprint footprint(const ExactChain& chain, const geodesy::Projection& projection) {
  const double w = chain.camera().width_px(), h = chain.camera().height_px();
  const std::vector<Eigen::Vector2d> rectangle = {{0, 0}, {w, 0}, {w, h}, {0, h}};
  std::array<Eigen::Vector2d, 4> lon_lat;
  chain.lon_lat_from_image(rectangle, lon_lat);
  std::array<Eigen::Vector2d, 4> crs = lon_lat;
  projection.crs_from_lon_lat(crs);

  Footprint result;
  for (std::size_t i = 0; i < 4; ++i)
    if (const auto enu = chain.enu_from_image(rectangle[i])) result.corners[i] = GroundPoint{*enu, lon_lat[i], crs[i]};

  const auto image = chain.flat() ? densified(clip_at_horizon(chain, rectangle)) : drawn_in_to_ground(chain, rectangle);
  std::vector<Eigen::Vector2d> outline(image.size());
  chain.lon_lat_from_image(image, outline);
  for (const auto& p : outline)
    if (p.allFinite()) result.outline_lon_lat_rad.push_back(p);
  return result;
}

}  // namespace nadir::render

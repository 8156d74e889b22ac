#include "nadir/render/exact_chain.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace nadir::render {
using namespace geodesy;

namespace {
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Between two unit vectors, exact for small angles too.
double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}
}  // namespace

ExactChain::ExactChain(const Camera& camera, const CameraPose& ecef_from_camera, const Surface& surface)
    : camera_(camera),
      ecef_from_camera_(ecef_from_camera),
      surface_(surface),
      flat_(surface.plane() && camera.lens().ideal()),
      enu_from_camera_(surface.frame().enu_from_ecef() * ecef_from_camera) {
  if (camera.lens().ideal())
    enu_ray_from_image_ = enu_from_camera_.rotation.toRotationMatrix() * camera.ray_from_image();
  if (const Plane* plane = surface_.plane()) {
    above_m_ = enu_from_camera_.origin.z() - plane->up_m();
    smallest_sink_ = above_m_ / plane_reach_m(above_m_);
    ground_axis_ = -Eigen::Vector3d::UnitZ();
    ground_angle_ = above_m_ > 0 ? std::acos(smallest_sink_) : 0;
  } else {
    const Ellipsoid& ellipsoid = *surface_.ellipsoid();
    above_m_ = geodetic_from_ecef({ecef_from_camera.origin}).height_m - ellipsoid.height_m();
    const Eigen::Vector3d from = ellipsoid.to_unit_sphere(ecef_from_camera.origin);
    ground_axis_ = -from.normalized();
    ground_angle_ = above_m_ > 0 ? std::asin(std::min(1.0, 1 / from.norm())) : 0;
  }
}

/// A ray as a unit vector in the axes of the cone of rays that see ground.
Eigen::Vector3d ExactChain::towards_ground(const Eigen::Vector3d& camera_ray) const {
  if (const Ellipsoid* ellipsoid = surface_.ellipsoid())
    return ellipsoid->to_unit_sphere(ecef_from_camera_.rotation * camera_ray).normalized();
  return (enu_from_camera_.rotation * camera_ray).normalized();
}

Eigen::Vector3d ExactChain::down() const {
  if (surface_.plane()) return enu_from_camera_.rotation.conjugate() * -Eigen::Vector3d::UnitZ();
  return ecef_from_camera_.rotation.conjugate() * -ecef_from_camera_.origin.normalized();
}

double ExactChain::visibility(const Eigen::Vector2d& image) const {
  if (!(above_m_ > 0)) return -1;
  if (flat_) return -enu_ray_from_image_.row(2).dot(image.homogeneous()) - smallest_sink_;
  return enu_from_image(image) ? 1 : -1;
}

Sight ExactChain::look(const Eigen::AlignedBox2d& rectangle) const {
  if (!(above_m_ > 0)) return Sight::None;
  if (flat_) {
    int seen = 0;
    for (const auto corner : {Eigen::AlignedBox2d::BottomLeft, Eigen::AlignedBox2d::BottomRight,
                              Eigen::AlignedBox2d::TopLeft, Eigen::AlignedBox2d::TopRight})
      seen += visibility(rectangle.corner(corner)) > 0 ? 1 : 0;
    return seen == 0 ? Sight::None : seen == 4 ? Sight::All : Sight::Some;
  }
  // Corners, edges and the middle
  std::array<std::optional<Eigen::Vector3d>, 9> rays;
  int found = 0;
  for (int i = 0; i < 9; ++i) {
    const Eigen::Vector2d at = rectangle.min() + rectangle.sizes().cwiseProduct(Eigen::Vector2d(i % 3, i / 3) / 2);
    rays[static_cast<std::size_t>(i)] = camera_.ray_of(at);
    found += rays[static_cast<std::size_t>(i)] ? 1 : 0;
  }
  if (found < 9) {
    // A lens fills a disc, but for a few percent by which tangential distortion dents it. All of the rectangle lies
    // beyond where its nearest point does, with a tenth to spare.
    const Eigen::Vector2d axis = camera_.principal_point_px();
    const Eigen::Vector2d nearest = axis.cwiseMax(rectangle.min()).cwiseMin(rectangle.max());
    return found == 0 && !camera_.ray_of(axis + 0.9 * (nearest - axis)) ? Sight::None : Sight::Some;
  }
  const Eigen::Vector3d middle = towards_ground(*rays[4]);
  double spread = 0;
  for (const auto& ray : rays) spread = std::max(spread, angle_between(middle, towards_ground(*ray)));
  // Through an ideal lens the greatest angle is a corner's; others bend between the places looked at.
  if (!camera_.lens().ideal()) spread = 1.25 * spread + 1e-3;
  constexpr double to_spare = 1e-4;
  const double aside = angle_between(middle, ground_axis_);
  if (aside - spread > ground_angle_ + to_spare) return Sight::None;
  if (aside + spread < ground_angle_ - to_spare) return Sight::All;
  return Sight::Some;
}

Eigen::Matrix3d ExactChain::plane_from_image() const {
  assert(flat_);
  // The ray c + t d meets the plane at t = above / -d_z; east and north are c_xy + t d_xy, over the common denominator
  // -d_z.
  Eigen::Matrix3d h;
  h.row(2) = -enu_ray_from_image_.row(2);
  for (int axis = 0; axis < 2; ++axis)
    h.row(axis) = enu_from_camera_.origin[axis] * h.row(2) + above_m_ * enu_ray_from_image_.row(axis);
  return h;
}

std::optional<Eigen::Vector3d> ExactChain::plane_hit(const Plane& plane, const Eigen::Vector2d& image) const {
  Eigen::Vector3d ray;
  if (flat_) {
    if (!(visibility(image) > 0)) return std::nullopt;
    ray = enu_ray_from_image_ * image.homogeneous();
  } else {
    const auto camera_ray = camera_.ray_of(image);
    if (!camera_ray) return std::nullopt;
    ray = enu_from_camera_.rotation * *camera_ray;
    if (!(-ray.z() > smallest_sink_)) return std::nullopt;
  }
  const auto point = plane.hit({enu_from_camera_.origin}, {ray});
  return point ? std::optional<Eigen::Vector3d>(point->xyz) : std::nullopt;
}

std::optional<Point<frame::Ecef>> ExactChain::ellipsoid_hit(const Eigen::Vector2d& image) const {
  const auto camera_ray = camera_.ray_of(image);
  if (!camera_ray) return std::nullopt;
  return surface_.ellipsoid()->hit({ecef_from_camera_.origin}, {ecef_from_camera_.rotation * *camera_ray});
}

std::optional<Eigen::Vector3d> ExactChain::enu_from_image(const Eigen::Vector2d& image) const {
  if (const Plane* plane = surface_.plane()) return plane_hit(*plane, image);
  const auto point = ellipsoid_hit(image);
  if (!point) return std::nullopt;
  return (surface_.frame().enu_from_ecef() * *point).xyz;
}

void ExactChain::lon_lat_from_image(std::span<const Eigen::Vector2d> image,
                                    std::span<Eigen::Vector2d> lon_lat_rad) const {
  assert(image.size() == lon_lat_rad.size());
  for (std::size_t i = 0; i < image.size(); ++i) {
    lon_lat_rad[i] = {nan, nan};
    std::optional<Point<frame::Ecef>> point;
    if (const Plane* plane = surface_.plane()) {
      if (const auto enu = plane_hit(*plane, image[i]))
        point = plane->frame().ecef_from_enu() * Point<frame::Enu>{*enu};
    } else {
      point = ellipsoid_hit(image[i]);
    }
    if (!point) continue;
    const Geodetic place = geodetic_from_ecef(*point);
    lon_lat_rad[i] = {place.lon_rad, place.lat_rad};
  }
}

void ExactChain::crs_from_image(const Projection& projection, std::span<const Eigen::Vector2d> image,
                                std::span<Eigen::Vector2d> crs) const {
  lon_lat_from_image(image, crs);
  projection.crs_from_lon_lat(crs);
}

}  // namespace nadir::render

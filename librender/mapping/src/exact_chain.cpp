#include "nadir/render/exact_chain.h"

#include <algorithm>
#include <cassert>
#include <limits>

namespace nadir::render {
using namespace geodesy;

ExactChain::ExactChain(const Camera& camera, const CameraPose& ecef_from_camera, const Plane& plane)
    : camera_(camera),
      ecef_from_camera_(ecef_from_camera),
      plane_(plane),
      enu_from_camera_(plane.frame().enu_from_ecef() * ecef_from_camera),
      enu_ray_from_image_(enu_from_camera_.rotation.toRotationMatrix() * camera.ray_from_image()),
      above_m_(enu_from_camera_.origin.z() - plane.up_m()) {
  const double reach_m = std::max(1e6, 4 * above_m_);
  smallest_sink_ = above_m_ / reach_m;
}

double ExactChain::visibility(const Eigen::Vector2d& image) const {
  if (!(above_m_ > 0)) return -1;
  return -enu_ray_from_image_.row(2).dot(image.homogeneous()) - smallest_sink_;
}

Eigen::Matrix3d ExactChain::plane_from_image() const {
  // The ray c + t d meets the plane at t = above / -d_z; east and north are c_xy + t d_xy, over the common denominator
  // -d_z.
  Eigen::Matrix3d h;
  h.row(2) = -enu_ray_from_image_.row(2);
  for (int axis = 0; axis < 2; ++axis)
    h.row(axis) = enu_from_camera_.origin[axis] * h.row(2) + above_m_ * enu_ray_from_image_.row(axis);
  return h;
}

void ExactChain::plane_from_image(std::span<const Eigen::Vector2d> image,
                                  std::span<Eigen::Vector2d> east_north_m) const {
  assert(image.size() == east_north_m.size());
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < image.size(); ++i) {
    east_north_m[i] = {nan, nan};
    if (!(visibility(image[i]) > 0)) continue;
    const Direction<frame::Enu> ray{enu_ray_from_image_ * image[i].homogeneous()};
    if (const auto point = plane_.hit({enu_from_camera_.origin}, ray)) east_north_m[i] = point->xyz.head<2>();
  }
}

void ExactChain::lon_lat_from_image(std::span<const Eigen::Vector2d> image,
                                    std::span<Eigen::Vector2d> lon_lat_rad) const {
  plane_from_image(image, lon_lat_rad);
  for (auto& p : lon_lat_rad) {
    if (!p.allFinite()) continue;
    const Geodetic place =
        geodetic_from_ecef(plane_.frame().ecef_from_enu() * Point<frame::Enu>{{p.x(), p.y(), plane_.up_m()}});
    p = {place.lon_rad, place.lat_rad};
  }
}

void ExactChain::crs_from_image(const Projection& projection, std::span<const Eigen::Vector2d> image,
                                std::span<Eigen::Vector2d> crs) const {
  lon_lat_from_image(image, crs);
  projection.crs_from_lon_lat(crs);
}

}  // namespace nadir::render

#include "nadir/render/camera.h"

#include <fmt/format.h>

#include <cmath>

namespace nadir::render {
namespace {
// Beyond these no image has an extent that a double can tell
constexpr double least_focal_px = 1e-6, greatest_focal_px = 1e12, farthest_principal_point_px = 1e9;
}  // namespace

Result<Camera> Camera::pinhole(int width_px, int height_px, double fx_px, double fy_px, double cx_px, double cy_px) {
  constexpr int largest = 65536;
  if (width_px < 1 || height_px < 1 || width_px > largest || height_px > largest)
    return fail(Error::Kind::Malformed, fmt::format("camera: expected an image of 1 to {} pixels a side, found {} x {}",
                                                    largest, width_px, height_px));
  for (const double focal_px : {fx_px, fy_px})
    if (!(focal_px >= least_focal_px && focal_px <= greatest_focal_px))
      return fail(Error::Kind::Malformed,
                  fmt::format("camera: expected focal lengths of {:g} to {:g} pixels, found {} and {}", least_focal_px,
                              greatest_focal_px, fx_px, fy_px));
  if (!(std::abs(cx_px) <= farthest_principal_point_px && std::abs(cy_px) <= farthest_principal_point_px))
    return fail(
        Error::Kind::Malformed,
        fmt::format("camera: expected a principal point within {:g} pixels of the image's corner, found {} and {}",
                    farthest_principal_point_px, cx_px, cy_px));
  Camera camera;
  camera.width_px_ = width_px;
  camera.height_px_ = height_px;
  camera.focal_px_ = {fx_px, fy_px};
  camera.principal_point_px_ = {cx_px, cy_px};
  return camera;
}

Camera Camera::with_lens(Lens lens) const {
  Camera camera = *this;
  camera.lens_ = std::move(lens);
  return camera;
}

std::optional<Eigen::Vector3d> Camera::ray_of(const Eigen::Vector2d& image) const {
  return lens_.ray_of((image - principal_point_px_).cwiseQuotient(focal_px_));
}

std::optional<Eigen::Vector2d> Camera::image_of(const Eigen::Vector3d& ray) const {
  const auto point = lens_.image_of(ray);
  if (!point) return std::nullopt;
  return Eigen::Vector2d(point->cwiseProduct(focal_px_) + principal_point_px_);
}

Eigen::Matrix3d Camera::ray_from_image() const {
  Eigen::Matrix3d m;
  m << 1 / focal_px_.x(), 0, -principal_point_px_.x() / focal_px_.x(),  //
      0, 1 / focal_px_.y(), -principal_point_px_.y() / focal_px_.y(),   //
      0, 0, 1;
  return m;
}

Eigen::Matrix3d Camera::ros_camera_matrix() const {
  Eigen::Matrix3d k;
  k << focal_px_.x(), 0, principal_point_px_.x() - 0.5,  //
      0, focal_px_.y(), principal_point_px_.y() - 0.5,   //
      0, 0, 1;
  return k;
}

}  // namespace nadir::render

#pragma once

#include <optional>
#include <span>

#include "nadir/geodesy/projection.h"
#include "nadir/render/camera.h"
#include "nadir/render/mount.h"
#include "nadir/render/plane.h"

namespace nadir::render {

/// The definition of where a pixel looks: image point, ray, plane, ECEF, longitude and latitude, CRS. All in double, no
/// approximation but the projection library's own; everything faster is checked against it.
/// Error: about 1e-9 m of the camera's position (a double's step at the Earth's radius), magnified where the view
/// grazes.
class ExactChain {
 public:
  ExactChain(const Camera& camera, const CameraPose& ecef_from_camera, const Plane& plane);

  /// Positive where the ground is seen, negative where it is not: linear in image coordinates, so a rectangle whose
  /// corners all see no ground sees none. The ground counts as seen up to a depth (along the optical axis) of 1000 km
  /// or four times the camera's height, whichever is more: no plane is the Earth beyond.
  double visibility(const Eigen::Vector2d& image) const;

  /// Height of the camera above the plane, metres.
  double height_above_plane_m() const { return above_m_; }
  const geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera>& enu_from_camera() const { return enu_from_camera_; }
  const Camera& camera() const { return camera_; }
  const CameraPose& ecef_from_camera() const { return ecef_from_camera_; }
  const Plane& plane() const { return plane_; }

  /// East and north on the plane, metres from the scene origin, of what image points see: a homography, exact. To be
  /// applied where `visibility` is positive.
  Eigen::Matrix3d plane_from_image() const;

  /// Each result is NaN where its image point sees no ground.
  void plane_from_image(std::span<const Eigen::Vector2d> image, std::span<Eigen::Vector2d> east_north_m) const;
  void lon_lat_from_image(std::span<const Eigen::Vector2d> image, std::span<Eigen::Vector2d> lon_lat_rad) const;
  void crs_from_image(const geodesy::Projection& projection, std::span<const Eigen::Vector2d> image,
                      std::span<Eigen::Vector2d> crs) const;

 private:
  Camera camera_;
  CameraPose ecef_from_camera_;
  Plane plane_;
  geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera> enu_from_camera_;
  Eigen::Matrix3d enu_ray_from_image_;  // of depth 1
  double above_m_, smallest_sink_;
};

}  // namespace nadir::render

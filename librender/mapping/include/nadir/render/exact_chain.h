#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <span>

#include "nadir/geodesy/projection.h"
#include "nadir/render/camera.h"
#include "nadir/render/mount.h"
#include "nadir/render/surface.h"

namespace nadir::render {

/// What part of a rectangle of the image sees ground, as far as that is certain without looking at every point.
enum class Sight { None, Some, All };

/// The definition of where a pixel looks: image point, lens, ray, surface, longitude and latitude, CRS. All in double,
/// no approximation but the projection library's own; everything faster is checked against it.
/// Error: about 1e-9 m of the camera's position (a double's step at the Earth's radius), magnified where the view
/// grazes.
class ExactChain {
 public:
  ExactChain(const Camera& camera, const CameraPose& ecef_from_camera, const Surface& surface);

  /// An ideal lens over a plane: from image to plane there is one homography.
  bool flat() const { return flat_; }

  /// Positive where the ground is seen, negative where it is not. Flat chains: linear in image coordinates, so a
  /// rectangle whose corners all see no ground sees none. A plane counts as seen up to a depth (along the optical axis;
  /// through a lens that is not ideal, a distance) of `plane_reach_m`.
  double visibility(const Eigen::Vector2d& image) const;

  /// What a rectangle sees: of flat chains by its corners. Else ground fills a cone around one direction: it is None or
  /// All where the cone around the rectangle's rays lies wholly beside that one or within it, 1e-4 rad to spare.
  Sight look(const Eigen::AlignedBox2d& rectangle) const;

  /// Unit vector towards the ground below, in camera axes: the plane's, or the middle of the Earth's disc.
  Eigen::Vector3d down() const;

  /// How far a plane counts as ground from so high above it, in metres: no plane is the Earth beyond.
  static double plane_reach_m(double above_m) { return std::max(1e6, 4 * above_m); }

  /// Height of the camera above the surface, metres.
  double height_above_ground_m() const { return above_m_; }
  const geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera>& enu_from_camera() const { return enu_from_camera_; }
  const Camera& camera() const { return camera_; }
  const CameraPose& ecef_from_camera() const { return ecef_from_camera_; }
  const Surface& surface() const { return surface_; }

  /// East and north on the plane, metres from the scene origin, of what image points see: a homography, exact. To be
  /// applied where `visibility` is positive. Flat chains only.
  Eigen::Matrix3d plane_from_image() const;

  /// What an image point sees, in the scene's local frame; empty where that is no ground.
  std::optional<Eigen::Vector3d> enu_from_image(const Eigen::Vector2d& image) const;

  /// Each result is NaN where its image point sees no ground.
  void lon_lat_from_image(std::span<const Eigen::Vector2d> image, std::span<Eigen::Vector2d> lon_lat_rad) const;
  void crs_from_image(const geodesy::Projection& projection, std::span<const Eigen::Vector2d> image,
                      std::span<Eigen::Vector2d> crs) const;

 private:
  std::optional<Eigen::Vector3d> plane_hit(const Plane& plane, const Eigen::Vector2d& image) const;
  std::optional<geodesy::Point<geodesy::frame::Ecef>> ellipsoid_hit(const Eigen::Vector2d& image) const;
  Eigen::Vector3d towards_ground(const Eigen::Vector3d& camera_ray) const;

  Camera camera_;
  CameraPose ecef_from_camera_;
  Surface surface_;
  bool flat_;
  geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera> enu_from_camera_;
  Eigen::Matrix3d enu_ray_from_image_ = Eigen::Matrix3d::Zero();  // of depth 1; flat chains
  double above_m_ = 0, smallest_sink_ = 0;
  Eigen::Vector3d ground_axis_ = Eigen::Vector3d::UnitZ();  // of the cone of rays that see ground, as towards_ground
  double ground_angle_ = 0;                                 // gives them; half of its opening, rad
};

}  // namespace nadir::render

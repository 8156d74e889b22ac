#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "nadir/geodesy/projection.h"
#include "nadir/render/camera.h"
#include "nadir/render/motion.h"
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

  /// Of a camera in motion, at `of_exposure_s` from the middle of each row's exposure; `motion` counts time from the
  /// frame's stamp. With a readout each row has a pose of its own; without one the frame is still.
  ExactChain(const Camera& camera, const CameraMotion& motion, const Shutter& shutter, const Surface& surface,
             double of_exposure_s = 0);

  /// Rows have poses of their own.
  bool rolling() const { return rolling_.has_value(); }

  /// Rows at which a rolling shutter's motion changes its velocity, image coordinates, rising.
  std::vector<double> kinks() const;

  /// An ideal lens over a plane, still: from image to plane there is one homography.
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

  /// Height of the camera above the surface, metres; of a rolling shutter in the image's middle row, as the poses
  /// below.
  double height_above_ground_m() const { return ground_.above_m; }
  const geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera>& enu_from_camera() const { return enu_from_camera_; }
  const Camera& camera() const { return camera_; }
  const CameraPose& ecef_from_camera() const { return ecef_from_camera_; }
  /// The pose that the row at an image coordinate has.
  CameraPose ecef_from_camera_at(double image_y) const {
    return rolling_ ? rolling_->motion.at(rolling_->time_s(image_y)) : ecef_from_camera_;
  }
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
  struct Rolling {
    CameraMotion motion;
    double middle_s, readout_s, height_px;
    double time_s(double image_y) const { return middle_s + readout_s * (image_y / height_px - 0.5); }
  };

  /// The cone of rays that see ground from a pose: its axis as `towards_ground` gives rays, half of its opening, 0 from
  /// below the ground, and what height that is.
  struct GroundCone {
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    double angle_rad = 0, above_m = 0;
  };
  GroundCone ground_cone(const CameraPose& ecef_from_camera) const;
  /// How far any row's cone may lie from the middle row's.
  double greatest_cone_shift_rad() const;

  std::optional<Eigen::Vector3d> plane_hit(const Plane& plane, const Eigen::Vector2d& image) const;
  std::optional<geodesy::Point<geodesy::frame::Ecef>> ellipsoid_hit(const Eigen::Vector2d& image) const;
  Eigen::Vector3d towards_ground(const Eigen::Vector3d& camera_ray, const CameraPose& pose) const;

  Camera camera_;
  CameraPose ecef_from_camera_;
  Surface surface_;
  std::optional<Rolling> rolling_;
  bool flat_;
  geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera> enu_from_camera_;
  Eigen::Matrix3d enu_ray_from_image_ = Eigen::Matrix3d::Zero();  // of depth 1; flat chains
  double smallest_sink_ = 0;
  GroundCone ground_;
  double cone_shift_rad_ = 0;
};

}  // namespace nadir::render

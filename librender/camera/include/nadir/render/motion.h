#pragma once

#include <memory>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/render/mount.h"

namespace nadir::render {

/// When the rows of a frame are exposed. The frame's stamp is the middle of the exposure of its middle row.
struct Shutter {
  double exposure_s = 0;  // of each row
  double readout_s = 0;   // from the exposure of the image's upper edge to that of its lower one: 0 is a global shutter

  /// Neither blurs nor bends: a frame is one pose.
  bool instant() const { return exposure_s == 0 && readout_s == 0; }
};
Result<void> check(const Shutter& shutter);

/// The pose of a camera at a moment of its motion.
struct Moment {
  double time_s = 0;
  CameraPose ecef_from_camera;
};

/// How a camera moves: between two moments in a straight line and with one angular velocity, the shorter way around. A
/// value; copies share the moments.
class CameraMotion {
 public:
  /// At least two moments, their times rising, their quaternions unit to 1e-3.
  static Result<CameraMotion> through(std::vector<Moment> moments);

  /// Before the first moment and after the last, the motion goes on as between the two nearest.
  CameraPose at(double time_s) const;

  /// Angle that the camera turns through, added up, from one time to a later one; radians.
  double turn_rad(double from_s, double to_s) const;

  /// Times between two others at which the velocity changes, rising.
  std::vector<double> moments_between(double from_s, double to_s) const;

  /// The motion with another zero of time: what was at `time_s` is at 0.
  CameraMotion from(double time_s) const;

 private:
  explicit CameraMotion(std::vector<Moment> moments)
      : moments_(std::make_shared<const std::vector<Moment>>(std::move(moments))) {}
  std::size_t segment(double time_s) const;
  std::shared_ptr<const std::vector<Moment>> moments_;
  double zero_s_ = 0;
};

/// Axis times angle of a rotation, the shorter way around, radians; and back.
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation);
Eigen::Quaterniond rotation_by(const Eigen::Vector3d& rotation_vector);

/// A pose as it is used: finite, its quaternion unit to 1e-3 and normalised where rounding left more than 1e-14.
Result<CameraPose> checked_pose(const CameraPose& pose);

}  // namespace nadir::render

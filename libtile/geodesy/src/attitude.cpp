#include "nadir/geodesy/attitude.h"

#include <cmath>
#include <numbers>

#include "nadir/geodesy/geodetic.h"

namespace nadir::geodesy {

YawPitchRoll YawPitchRoll::degrees(double yaw_deg, double pitch_deg, double roll_deg) {
  return {to_radians(yaw_deg), to_radians(pitch_deg), to_radians(roll_deg)};
}

Eigen::Quaterniond quaternion_from(const YawPitchRoll& angles) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return (AngleAxisd(angles.yaw_rad, Vector3d::UnitZ()) * AngleAxisd(angles.pitch_rad, Vector3d::UnitY()) *
          AngleAxisd(angles.roll_rad, Vector3d::UnitX()))
      .normalized();
}

YawPitchRoll yaw_pitch_roll_from(const Eigen::Quaterniond& rotation) {
  const Eigen::Matrix3d r = rotation.normalized().toRotationMatrix();
  YawPitchRoll angles;
  // Near straight up or down asin loses half its digits; the horizontal length of the forward axis does not.
  const double horizontal = std::hypot(r(0, 0), r(1, 0));
  angles.pitch_rad = std::atan2(-r(2, 0), horizontal);
  if (horizontal > 1e-6) {
    angles.yaw_rad = std::atan2(r(1, 0), r(0, 0));
    angles.roll_rad = std::atan2(r(2, 1), r(2, 2));
  } else {
    angles.yaw_rad = std::atan2(-r(0, 1), r(1, 1));
  }
  if (angles.yaw_rad < 0) angles.yaw_rad += 2 * std::numbers::pi;
  return angles;
}

}  // namespace nadir::geodesy

#pragma once

#include "nadir/geodesy/frames.h"

namespace nadir::geodesy {

/// Attitude as the aviation convention has it: intrinsic Z-Y-X, yaw clockwise from true north seen
/// from above, pitch nose up, roll right wing down. Radians.
struct YawPitchRoll {
  double yaw_rad = 0;
  double pitch_rad = 0;
  double roll_rad = 0;
  static YawPitchRoll degrees(double yaw_deg, double pitch_deg, double roll_deg);
};

/// Quaternion of the intrinsic Z-Y-X rotation, taking turned axes to the axes turned from.
Eigen::Quaterniond quaternion_from(const YawPitchRoll& angles);

/// yaw in [0, 2 pi), pitch in [-pi/2, pi/2], roll in (-pi, pi]. In gimbal lock (pitch within 1e-6 rad
/// of straight up or down) roll is 0 and yaw carries the whole turn.
YawPitchRoll yaw_pitch_roll_from(const Eigen::Quaterniond& rotation);

inline Rotation<frame::Ned, frame::Body> ned_from_body(const YawPitchRoll& angles) { return {quaternion_from(angles)}; }

}  // namespace nadir::geodesy

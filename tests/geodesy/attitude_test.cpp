#include "nadir/geodesy/attitude.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "nadir/geodesy/geodetic.h"

namespace nadir::geodesy {
namespace {

Eigen::Vector3d in_ned(const YawPitchRoll& angles, const Eigen::Vector3d& body) {
  return (ned_from_body(angles) * Direction<frame::Body>{body}).xyz;
}

TEST(Attitude, YawTurnsTheNoseClockwiseFromNorth) {
  EXPECT_NEAR((in_ned(YawPitchRoll::degrees(90, 0, 0), {1, 0, 0}) - Eigen::Vector3d(0, 1, 0)).norm(), 0, 1e-15)
      << "90 degrees is east";
  EXPECT_NEAR((in_ned(YawPitchRoll::degrees(180, 0, 0), {1, 0, 0}) - Eigen::Vector3d(-1, 0, 0)).norm(), 0, 1e-15);
}

TEST(Attitude, PitchLiftsTheNoseAndRollLowersTheRightWing) {
  const double s = std::sin(to_radians(10));
  EXPECT_NEAR(in_ned(YawPitchRoll::degrees(37, 10, 0), {1, 0, 0}).z(), -s, 1e-15) << "up is negative down";
  EXPECT_NEAR(in_ned(YawPitchRoll::degrees(37, 0, 10), {0, 1, 0}).z(), s, 1e-15);
}

TEST(Attitude, IsYawThenPitchThenRollAboutTurnedAxes) {
  // Written out: Beard and McLain, Small Unmanned Aircraft, 2012, equation 2.5, transposed.
  const double y = 0.7, p = -0.4, r = 1.9;
  const double cy = std::cos(y), sy = std::sin(y), cp = std::cos(p), sp = std::sin(p), cr = std::cos(r),
               sr = std::sin(r);
  Eigen::Matrix3d expected;
  expected << cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy,  //
      cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy,          //
      -sp, sr * cp, cr * cp;
  EXPECT_NEAR((quaternion_from({y, p, r}).toRotationMatrix() - expected).norm(), 0, 1e-15);
}

TEST(Attitude, AnglesComeBack) {
  for (const double yaw : {0.0, 30.0, 180.0, 359.0})
    for (const double pitch : {-89.99, -30.0, 0.0, 89.99})
      for (const double roll : {-179.0, 0.0, 45.0, 180.0}) {
        const YawPitchRoll angles = yaw_pitch_roll_from(quaternion_from(YawPitchRoll::degrees(yaw, pitch, roll)));
        const auto turn = [](double a, double b) { return std::abs(std::remainder(a - b, 360.0)); };
        // atan2 of a forward axis of horizontal length cos(pitch) >= 1.7e-4 magnifies rounding by 6e3.
        EXPECT_LT(turn(to_degrees(angles.yaw_rad), yaw), 1e-9);
        EXPECT_NEAR(to_degrees(angles.pitch_rad), pitch, 1e-9);
        EXPECT_LT(turn(to_degrees(angles.roll_rad), roll), 1e-9);
      }
}

TEST(Attitude, StraightUpAndDownGiveADefinedSplitThatIsTheSameRotation) {
  for (const double pitch : {90.0, -90.0}) {
    const Eigen::Quaterniond q = quaternion_from(YawPitchRoll::degrees(40, pitch, 25));
    const YawPitchRoll angles = yaw_pitch_roll_from(q);
    EXPECT_EQ(angles.roll_rad, 0);
    EXPECT_LT(quaternion_from(angles).angularDistance(q), 1e-7);
  }
}

}  // namespace
}  // namespace nadir::geodesy

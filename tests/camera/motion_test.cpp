#include "nadir/render/motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace nadir::render {
namespace {

CameraPose turned(double angle_rad, double x_m) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(1, 2, -2) / 3)), {x_m, 2 * x_m, 7}};
}

double angle_between(const CameraPose& a, const CameraPose& b) { return a.rotation.angularDistance(b.rotation); }

TEST(CameraMotion, IsStraightAndTurnsEvenlyBetweenItsMomentsAndGoesOnBeyondThem) {
  const auto motion = CameraMotion::through({{1, turned(0, 10)}, {3, turned(0.4, 20)}, {4, turned(1.4, 20)}}).value();
  const auto expect = [&](double time_s, double angle_rad, double x_m) {
    const CameraPose pose = motion.at(time_s), right = turned(angle_rad, x_m);
    EXPECT_NEAR(angle_between(pose, right), 0, 1e-12) << time_s;
    EXPECT_NEAR((pose.origin - right.origin).norm(), 0, 1e-12) << time_s;
    EXPECT_NEAR(pose.rotation.norm(), 1, 1e-15);
  };
  expect(2, 0.2, 15);
  expect(2.5, 0.3, 17.5);
  expect(3.25, 0.65, 20);
  expect(0, -0.2, 5);
  expect(5, 2.4, 20);
  // At a moment, its bits
  EXPECT_EQ(motion.at(3).rotation.coeffs(), turned(0.4, 20).rotation.coeffs());
  EXPECT_EQ(motion.from(3).at(0).origin, turned(0.4, 20).origin);
  EXPECT_NEAR(angle_between(motion.from(2).at(0.5), turned(0.3, 0)), 0, 1e-12);

  EXPECT_NEAR(motion.turn_rad(2, 3.5), 0.2 + 0.5, 1e-12);
  EXPECT_NEAR(motion.from(2).turn_rad(0, 0.25), 0.05, 1e-12);
  EXPECT_EQ(motion.moments_between(0, 9), std::vector<double>{3}) << "at the ends the velocity does not change";
  EXPECT_EQ(motion.from(1).moments_between(1.5, 2.5), std::vector<double>{2});
  EXPECT_TRUE(motion.moments_between(3.1, 9).empty());
}

TEST(CameraMotion, TurnsTheShorterWayWhateverTheSignsOfQuaternions) {
  CameraPose end = turned(0.4, 0);
  end.rotation.coeffs() = -end.rotation.coeffs();
  const auto motion = CameraMotion::through({{0, turned(0, 0)}, {1, end}}).value();
  EXPECT_NEAR(angle_between(motion.at(0.5), turned(0.2, 0)), 0, 1e-12);
  EXPECT_NEAR(motion.turn_rad(0, 1), 0.4, 1e-12);
}

TEST(CameraMotion, RotationVectorsGoBackAndForth) {
  for (const double angle : {0.0, 1e-300, 1e-9, 0.3, 3.0, std::numbers::pi - 1e-9}) {
    const Eigen::Vector3d v = angle * Eigen::Vector3d(2, -1, 2) / 3;
    EXPECT_NEAR((rotation_vector(rotation_by(v)) - v).norm(), 0, 1e-15 + 1e-15 * angle) << angle;
  }
}

TEST(CameraMotion, FaultsAreSaid) {
  const auto message_of = [](std::vector<Moment> moments) {
    const auto motion = CameraMotion::through(std::move(moments));
    return motion ? std::string() : motion.error().message;
  };
  EXPECT_NE(message_of({{0, turned(0, 0)}}).find("at least 2"), std::string::npos);
  EXPECT_NE(message_of({{0, turned(0, 0)}, {0, turned(1, 0)}}).find("moment 1"), std::string::npos);
  EXPECT_NE(message_of({{0, turned(0, 0)}, {std::nan(""), turned(1, 0)}}).find("moment 1"), std::string::npos);
  CameraPose bent = turned(0, 0);
  bent.rotation.w() = 3;
  EXPECT_NE(message_of({{0, bent}, {1, turned(1, 0)}}).find("moment 0: pose"), std::string::npos);

  EXPECT_TRUE(check(Shutter{0.1, 0.05}));
  for (const double wrong : {-0.1, std::nan(""), 1e9}) {
    EXPECT_EQ(check(Shutter{.exposure_s = wrong}).error().message.find("exposure"), 0u);
    EXPECT_EQ(check(Shutter{.readout_s = wrong}).error().message.find("readout"), 0u);
  }
}

}  // namespace
}  // namespace nadir::render

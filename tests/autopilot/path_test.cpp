#include "nadir/sim/path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {
constexpr double pi = std::numbers::pi;

Navigation at(double north_m, double east_m, double course_rad = 0) {
  Navigation now;
  now.north_m = north_m, now.east_m = east_m;
  now.course_rad = now.attitude.yaw_rad = course_rad;
  now.ground_speed_mps = now.airspeed_mps = 25;
  return now;
}

const StraightPath north{{0, 0}, {1000, 0}, 100, 200};

TEST(StraightPath, LeadsAlongItWhenOnIt) {
  const Guidance g = follow(north, at(250, 0), {});
  EXPECT_EQ(g.course_rad, 0);
  EXPECT_EQ(g.roll_rad, 0);
  EXPECT_DOUBLE_EQ(g.height_m, 125);
  EXPECT_DOUBLE_EQ(g.climb_rate_mps, 2.5) << "a slope of a tenth at 25 m/s";
}

TEST(StraightPath, LeadsBackFromEitherSideAtMostAtTheApproachAngle) {
  const PathGains gains;
  for (const double off : {0.1, 10.0, 1e3, 1e9}) {
    const double from_right = follow(north, at(0, off), gains).course_rad,
                 from_left = follow(north, at(0, -off), gains).course_rad;
    EXPECT_LT(from_right, 0) << "right of a northbound line, the way back is to the left";
    EXPECT_DOUBLE_EQ(from_left, -from_right);
    EXPECT_LE(from_left, gains.approach_rad);
  }
  EXPECT_NEAR(follow(north, at(0, -1e9), gains).course_rad, gains.approach_rad, 1e-6);
}

TEST(StraightPath, ErrorsArePositiveToTheRightAndAbove) {
  Navigation now = at(500, 7);
  now.height_m = 153;
  EXPECT_DOUBLE_EQ(path_error(north, now).right_m, 7);
  EXPECT_DOUBLE_EQ(path_error(north, now).above_m, 3);
  const StraightPath south_west{{0, 0}, {-1000, -1000}, 0, 0};
  EXPECT_NEAR(path_error(south_west, at(-500 + 3, -500 - 3)).right_m, 3 * std::sqrt(2), 1e-12)
      << "right of south-west is north-west";
}

CirclePath circle(bool clockwise) {
  CirclePath path;
  path.radius_m = 100;
  path.center = {0, 0};
  path.clockwise = clockwise;
  return path;
}

TEST(CirclePath, OnItTheCourseIsTangentAndTheBankThatOfTheTurn) {
  const Guidance right = follow(circle(true), at(100, 0, pi / 2), {});  // north of the centre
  EXPECT_NEAR(right.course_rad, pi / 2, 1e-15);
  EXPECT_NEAR(right.roll_rad, std::atan(625 / (9.81 * 100)), 1e-15);
  const Guidance left = follow(circle(false), at(100, 0, -pi / 2), {});
  EXPECT_NEAR(left.course_rad, -pi / 2, 1e-15);
  EXPECT_NEAR(left.roll_rad, -right.roll_rad, 1e-15);
}

TEST(CirclePath, FarOutTheCourseIsTowardsTheCentreAndFromInsideAway) {
  EXPECT_NEAR(std::remainder(follow(circle(true), at(1e9, 0), {}).course_rad - pi, 2 * pi), 0, 1e-6);
  const double inside = follow(circle(true), at(10, 0), {}).course_rad;
  EXPECT_GT(inside, 0);
  EXPECT_LT(inside, pi / 2) << "outwards and onwards";
  EXPECT_TRUE(std::isfinite(follow(circle(true), at(0, 0), {}).course_rad)) << "in the centre itself too";
}

TEST(CirclePath, ClimbsOverItsSweepAndStaysLevelAfterIt) {
  CirclePath path = circle(true);
  path.from_rad = 0, path.sweep_rad = pi / 2;
  path.from_height_m = 100, path.to_height_m = 110;
  const auto height = [&](double bearing) {
    return follow(path, at(100 * std::cos(bearing), 100 * std::sin(bearing)), {}).height_m;
  };
  EXPECT_DOUBLE_EQ(height(0), 100);
  EXPECT_NEAR(height(pi / 4), 105, 1e-12);
  EXPECT_NEAR(height(pi / 2 + 0.1), 110, 1e-12);
  EXPECT_NEAR(height(-0.1), 100, 1e-12) << "a little early is not begun";
  EXPECT_NEAR(follow(path, at(100, 0.001), {}).climb_rate_mps, 25 * 10 / (100 * pi / 2), 1e-9);
}

TEST(CirclePath, ErrorsArePositiveToTheRightOfTheFlight) {
  EXPECT_NEAR(path_error(circle(true), at(103, 0)).right_m, -3, 1e-12) << "outside a right turn is left";
  EXPECT_NEAR(path_error(circle(false), at(103, 0)).right_m, 3, 1e-12);
}

}  // namespace
}  // namespace nadir::sim

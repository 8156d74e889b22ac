#include "nadir/sim/position_trajectory.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

PositionWaypoint at(double north, double east, double height, std::optional<double> hold_s = {}) {
  return {.at = {north, east, height}, .hold_s = hold_s, .speed_mps = {}, .yaw_rad = {}};
}

const TrajectoryLimits limits{.speed_mps = 8, .climb_mps = 2, .descent_mps = 1.5, .acceleration_mps2 = 2};

/// What holds of every trajectory: limits, and derivatives that are those of the position.
void expect_sound(const PositionTrajectory& way, double until_s) {
  constexpr double step = 1e-3;
  double fastest = 0, hardest = 0;
  for (double t = step; t < until_s; t += 0.01) {
    const TrajectoryPoint before = way.at(t - step), now = way.at(t), after = way.at(t + step);
    fastest = std::max(fastest, now.velocity_ned_mps.norm());
    hardest = std::max(hardest, now.acceleration_ned_mps2.norm());
    EXPECT_LE(-now.velocity_ned_mps.z(), limits.climb_mps + 1e-9);
    EXPECT_LE(now.velocity_ned_mps.z(), limits.descent_mps + 1e-9);
    const Vector3d velocity = (after.position_ned_m - before.position_ned_m) / (2 * step);
    const Vector3d acceleration = (after.velocity_ned_mps - before.velocity_ned_mps) / (2 * step);
    // A jerk of 6 a / T over a step, T the shortest change
    ASSERT_NEAR((velocity - now.velocity_ned_mps).norm(), 0, 1e-4) << t;
    ASSERT_NEAR((acceleration - now.acceleration_ned_mps2).norm(), 0, 0.03) << t;
  }
  EXPECT_LE(fastest, limits.speed_mps + 1e-9);
  EXPECT_LE(hardest, limits.acceleration_mps2 + 1e-9);
  EXPECT_GT(hardest, 0.99 * limits.acceleration_mps2);
}

TEST(PositionTrajectory, StaysWithinItsLimitsAndIsSmooth) {
  const PositionWaypoint points[] = {at(100, 0, 30), at(100, 80, 10, 2.0), at(0, 80, 10), at(0, 1, 10), at(0, 0, 40)};
  const auto way = PositionTrajectory::create({0, 0, 20}, points, limits);
  ASSERT_TRUE(way) << way.error().message;
  expect_sound(*way, *way->end_s() + 1);
  EXPECT_EQ(way->at(0).position_ned_m, Vector3d(0, 0, -20));
  EXPECT_EQ(way->at(0).velocity_ned_mps, Vector3d::Zero());
  EXPECT_NEAR((way->at(*way->end_s() + 5).position_ned_m - Vector3d(0, 0, -40)).norm(), 0, 1e-9);
  EXPECT_EQ(way->at(*way->end_s() + 5).velocity_ned_mps, Vector3d::Zero());
}

TEST(PositionTrajectory, StopsWhereItIsToHoldAndPassesCornersAtTheDistanceOfTheirTurn) {
  const PositionWaypoint points[] = {at(100, 0, 20, 3.0), at(100, 100, 20), at(0, 100, 20)};
  const auto way = PositionTrajectory::create({0, 0, 20}, points, limits);
  ASSERT_TRUE(way);
  double held_s = 0, nearest_m = 1e9;
  for (double t = 0; t < *way->end_s(); t += 0.001) {
    const TrajectoryPoint p = way->at(t);
    if ((p.position_ned_m - Vector3d(100, 0, -20)).norm() < 1e-9) held_s += 0.001;
    nearest_m = std::min(nearest_m, (p.position_ned_m - Vector3d(100, 100, -20)).norm());
  }
  EXPECT_NEAR(held_s, 3, 0.01);
  EXPECT_NEAR(nearest_m, 9 * 2 * 64.0 / (64 * 2), 0.01) << "9 dv^2 / (64 a), 8 m/s turned by 90 degrees";
}

TEST(PositionTrajectory, RepeatsWithoutASeam) {
  for (const bool stop : {false, true}) {
    const PositionWaypoint points[] = {at(60, 0, 20), at(60, 60, 25, stop ? std::optional(1.0) : std::nullopt),
                                       at(0, 60, 20), at(0, 0, 20)};
    const auto way = PositionTrajectory::create({-30, -20, 20}, points, limits, true);
    ASSERT_TRUE(way) << way.error().message;
    EXPECT_FALSE(way->end_s());
    expect_sound(*way, 300);
  }
  const PositionWaypoint two[] = {at(60, 0, 20), at(0, 0, 20)};
  const auto there_and_back = PositionTrajectory::create({0, 10, 20}, two, limits, true);
  ASSERT_TRUE(there_and_back);
  expect_sound(*there_and_back, 100);
}

TEST(PositionTrajectory, SaysWhatIsWrong) {
  const auto message = [](const std::vector<PositionWaypoint>& points, const TrajectoryLimits& l = limits) {
    const auto way = PositionTrajectory::create({0, 0, 20}, points, l);
    return way ? "made" : way.error().message;
  };
  EXPECT_NE(message({}).find("at least 1 waypoint"), std::string::npos);
  EXPECT_NE(message({at(0, 0, 20)}).find("the start and waypoint 1"), std::string::npos);
  EXPECT_NE(message({at(std::nan(""), 0, 20)}).find("waypoint 1: a coordinate"), std::string::npos);
  EXPECT_NE(message({at(5, 0, 20, -1)}).find("hold"), std::string::npos);
  TrajectoryLimits none = limits;
  none.acceleration_mps2 = 0;
  EXPECT_NE(message({at(5, 0, 20)}, none).find("above 0"), std::string::npos);
}

}  // namespace
}  // namespace nadir::sim

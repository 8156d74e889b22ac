#include "nadir/sim/mission.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace nadir::sim {
namespace {

Navigation at(double north_m, double east_m) {
  Navigation now;
  now.north_m = north_m, now.east_m = east_m;
  return now;
}
const Waypoint start{0, 0, 100};

/// The pieces in the order a vehicle meets them that flies exactly along them, in steps of 1 m.
std::vector<Path> flown(Mission& mission, double metres, Eigen::Vector2d p = {0, 0}) {
  std::vector<Path> pieces;
  Navigation now;
  now.ground_speed_mps = 25;
  for (double s = 0; s < metres; s += 1) {
    now.north_m = p.x(), now.east_m = p.y();
    const Path path = mission.path_at(now);
    const auto same = [](const Path& a, const Path& b) {
      if (a.index() != b.index()) return false;
      if (const auto* line = std::get_if<StraightPath>(&a)) return line->from == std::get<StraightPath>(b).from;
      return std::get<CirclePath>(a).center == std::get<CirclePath>(b).center;
    };
    if (pieces.empty() || !same(pieces.back(), path)) pieces.push_back(path);
    now.course_rad = now.attitude.yaw_rad = follow(path, now, {}).course_rad;
    p += Eigen::Vector2d(std::cos(now.course_rad), std::sin(now.course_rad));
  }
  return pieces;
}

TEST(Mission, FilletsTouchBothLegsInsideTheCorner) {
  const Waypoint corners[] = {{1000, 0, 100}, {1000, 1000, 200}};
  Mission mission = Mission::create(start, corners, 100).value();
  const auto pieces = flown(mission, 3000);
  ASSERT_EQ(pieces.size(), 4u);  // leg, fillet, leg, circle
  const auto& arc = std::get<CirclePath>(pieces[1]);
  EXPECT_NEAR((arc.center - Eigen::Vector2d(900, 100)).norm(), 0, 1e-9);
  EXPECT_TRUE(arc.clockwise);
  EXPECT_NEAR(arc.from_rad, -std::numbers::pi / 2, 1e-12) << "entered west of its centre";
  EXPECT_NEAR(arc.sweep_rad, std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(arc.from_height_m, 100, 1e-9);
  EXPECT_NEAR(arc.to_height_m, 110, 1e-9) << "a tenth of the next leg is cut off, and of its climb";
  const auto& circle = std::get<CirclePath>(pieces[3]);
  EXPECT_NEAR((circle.center - Eigen::Vector2d(900, 1000)).norm(), 0, 1e-9)
      << "to the right of an eastbound leg is south";
}

TEST(Mission, ALeftCornerIsTurnedLeft) {
  const Waypoint corners[] = {{1000, 0, 100}, {1000, -1000, 100}};
  Mission mission = Mission::create(start, corners, 100).value();
  const auto pieces = flown(mission, 2000);
  ASSERT_GE(pieces.size(), 2u);
  EXPECT_FALSE(std::get<CirclePath>(pieces[1]).clockwise);
}

TEST(Mission, CornersWithoutRoomForAnArcSwitchAtTheWaypoint) {
  for (const Waypoint& second :
       {Waypoint{0, 1, 100}, Waypoint{1100, 50, 100}, Waypoint{2000, 0, 100}}) {  // back, too near, straight on
    const Waypoint corners[] = {{1000, 0, 100}, second};
    Mission mission = Mission::create(start, corners, 300).value();
    mission.path_at(at(999, 0));
    EXPECT_EQ(std::get<StraightPath>(mission.path_at(at(999, 0))).from, Eigen::Vector2d(0, 0));
    EXPECT_EQ(std::get<StraightPath>(mission.path_at(at(1000, 0))).from, Eigen::Vector2d(1000, 0));
  }
}

TEST(Mission, RepeatingGoesRoundAndRoundWithFilletsAtEveryCorner) {
  const Waypoint corners[] = {{1000, 0, 100}, {1000, 1000, 100}, {0, 1000, 100}, {0, 5, 100}};
  Mission mission = Mission::create(start, corners, 100, AfterMission::Repeat).value();
  const auto pieces = flown(mission, 12000);
  ASSERT_GT(pieces.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(std::holds_alternative<CirclePath>(pieces[i]), i % 2 == 1) << i;
  for (std::size_t i = 2; i < 10; i += 2)
    EXPECT_EQ(std::get<StraightPath>(pieces[i]).from, std::get<StraightPath>(pieces[i + 8]).from)
        << "a round is four legs";
  EXPECT_FALSE(mission.finished());
}

TEST(Mission, LaterRoundsLeaveOutTheWayFromTheStart) {
  // From the start the first corner is a sharp one, with an arc far into the second leg: none of that comes again.
  const Waypoint corners[] = {{1000, 0, 100}, {1000, 1000, 100}, {0, 1000, 100}, {0, 0, 100}};
  Mission mission = Mission::create({0, 2000, 100}, corners, 100, AfterMission::Repeat).value();
  const auto pieces = flown(mission, 9000, {0, 2000});
  ASSERT_GT(pieces.size(), 12u);
  const auto center = [&](std::size_t i) { return std::get<CirclePath>(pieces[i]).center; };
  EXPECT_GT((center(1) - Eigen::Vector2d(900, 100)).norm(), 100);
  EXPECT_NEAR((center(9) - Eigen::Vector2d(900, 100)).norm(), 0, 1e-9) << "the same corner, now of the square";
  EXPECT_EQ(std::get<StraightPath>(pieces[10]).from, Eigen::Vector2d(1000, 0));
  EXPECT_NEAR((center(11) - center(3)).norm(), 0, 1e-9);
}

TEST(Mission, NonsenseIsRefusedWithTheWaypointNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [](std::vector<Waypoint> waypoints, double radius, AfterMission after = AfterMission::Circle) {
    const auto mission = Mission::create(start, waypoints, radius, after);
    return mission ? std::string("accepted") : mission.error().message;
  };
  EXPECT_NE(message({}, 100).find("at least one waypoint"), std::string::npos);
  EXPECT_NE(message({{0, 0, 500}}, 100).find("the start and waypoint 1"), std::string::npos);
  EXPECT_NE(message({{500, 0, 1}, {500, 0.5, 1}}, 100).find("waypoint 1 and waypoint 2"), std::string::npos);
  EXPECT_NE(message({{500, 0, 1}, {nan, 0, 1}}, 100).find("waypoint 2"), std::string::npos);
  EXPECT_NE(message({{500, 0, 1}}, 0).find("turn radius"), std::string::npos);
  EXPECT_NE(message({{500, 0, 1}}, nan).find("turn radius"), std::string::npos);
  EXPECT_NE(message({{500, 0, 1}}, 100, AfterMission::Repeat).find("two waypoints"), std::string::npos);
}

TEST(Mission, APositionThatIsNotANumberPassesNoWaypoint) {
  const Waypoint corners[] = {{1000, 0, 100}, {1000, 1000, 100}};
  Mission mission = Mission::create(start, corners, 100).value();
  EXPECT_EQ(std::get<StraightPath>(mission.path_at(at(std::nan(""), 0))).from, Eigen::Vector2d(0, 0));
}

}  // namespace
}  // namespace nadir::sim

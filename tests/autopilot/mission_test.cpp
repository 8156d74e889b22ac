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
    const Path path = mission.piece_at(now, s / 25).path;
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
  const MissionItem corners[] = {Waypoint{1000, 0, 100}, Waypoint{1000, 1000, 200}};
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
  const MissionItem corners[] = {Waypoint{1000, 0, 100}, Waypoint{1000, -1000, 100}};
  Mission mission = Mission::create(start, corners, 100).value();
  const auto pieces = flown(mission, 2000);
  ASSERT_GE(pieces.size(), 2u);
  EXPECT_FALSE(std::get<CirclePath>(pieces[1]).clockwise);
}

TEST(Mission, CornersWithoutRoomForAnArcSwitchAtTheWaypoint) {
  for (const Waypoint& second :
       {Waypoint{0, 1, 100}, Waypoint{1100, 50, 100}, Waypoint{2000, 0, 100}}) {  // back, too near, straight on
    const MissionItem corners[] = {Waypoint{1000, 0, 100}, second};
    Mission mission = Mission::create(start, corners, 300).value();
    mission.piece_at(at(999, 0), 0);
    EXPECT_EQ(std::get<StraightPath>(mission.piece_at(at(999, 0), 0).path).from, Eigen::Vector2d(0, 0));
    EXPECT_EQ(std::get<StraightPath>(mission.piece_at(at(1000, 0), 0).path).from, Eigen::Vector2d(1000, 0));
  }
}

TEST(Mission, RepeatingGoesRoundAndRoundWithFilletsAtEveryCorner) {
  const MissionItem corners[] = {Waypoint{1000, 0, 100}, Waypoint{1000, 1000, 100}, Waypoint{0, 1000, 100},
                                 Waypoint{0, 5, 100}};
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
  const MissionItem corners[] = {Waypoint{1000, 0, 100}, Waypoint{1000, 1000, 100}, Waypoint{0, 1000, 100},
                                 Waypoint{0, 0, 100}};
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
  const auto message = [](std::vector<MissionItem> items, double radius, AfterMission after = AfterMission::Circle) {
    const auto mission = Mission::create(start, items, radius, after);
    return mission ? std::string("accepted") : mission.error().message;
  };
  const MissionItem far = Waypoint{500, 0, 1};
  EXPECT_NE(message({}, 100).find("at least one waypoint"), std::string::npos);
  EXPECT_NE(message({Waypoint{0, 0, 500}}, 100).find("waypoint 1: is less than 1 m from what comes before"),
            std::string::npos);
  EXPECT_NE(message({far, Waypoint{500, 0.5, 1}}, 100).find("waypoint 2: is less than 1 m"), std::string::npos);
  EXPECT_NE(message({far}, 0).find("turn radius"), std::string::npos);
  EXPECT_NE(message({far}, nan).find("turn radius"), std::string::npos);
  EXPECT_NE(message({far}, 100, AfterMission::Repeat).find("two waypoints"), std::string::npos);
}

TEST(Mission, AllFaultsAreToldAtOnceEachWithItsItem) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const MissionItem items[] = {Waypoint{500, 0, 1, 0.0, 0.0}, Waypoint{.north_m = nan},
                               Orbit{.radius_m = -5, .turns = 1, .seconds = 3}, Orbit{.radius_m = 50},
                               Waypoint{.north_m = 9, .airspeed_mps = 0}};
  const auto faults = Mission::faults(start, items, 100);
  std::vector<std::string> said;
  for (const MissionFault& f : faults) said.push_back(std::to_string(*f.item) + ": " + f.message);
  EXPECT_EQ(said, (std::vector<std::string>{
                      "0: expected a turn radius above 0 where a course is asked for, found 0 m",
                      "1: a coordinate is not a finite number", "2: expected a radius above 0, found -5 m",
                      "2: expected turns or a time, found both",
                      "3: goes on for ever, so that what follows is never reached: give it turns or a time",
                      "4: expected an airspeed above 0, found 0 m/s"}));
  const MissionItem good[] = {Waypoint{500, 0, 1}, Waypoint{500, 0.5, 1}, Waypoint{500, 0.9, 1}};
  EXPECT_EQ(Mission::faults(start, good, 100).size(), 2u);
}

/// Flown exactly, as `flown`: the pieces with how far each was flown, its heights included.
struct FlownPiece {
  std::size_t item;
  double metres;
  double least_north_m, most_north_m;
};
std::vector<FlownPiece> flown_items(Mission& mission, double metres, double step_m = 1) {
  std::vector<FlownPiece> pieces;
  Navigation now;
  now.ground_speed_mps = 25;
  const MissionPiece* last = nullptr;
  for (double s = 0; s < metres; s += step_m) {
    const MissionPiece& piece = mission.piece_at(now, s / 25);
    if (&piece != last) pieces.push_back({piece.item, 0, 1e9, -1e9});
    last = &piece;
    pieces.back().metres += step_m;
    pieces.back().least_north_m = std::min(pieces.back().least_north_m, now.north_m);
    pieces.back().most_north_m = std::max(pieces.back().most_north_m, now.north_m);
    now.course_rad = now.attitude.yaw_rad = follow(piece.path, now, {}).course_rad;
    now.north_m += step_m * std::cos(now.course_rad), now.east_m += step_m * std::sin(now.course_rad);
  }
  return pieces;
}

TEST(Mission, AnOrbitIsReachedAndLeftAlongTangentsAfterItsTurns) {
  for (const double turns : {0.1, 1.0, 2.0, 2.6}) {
    const MissionItem items[] = {
        Orbit{.north_m = 1000, .east_m = 200, .height_m = 150, .radius_m = 200, .turns = turns},
        Waypoint{1000, 2000, 100}};
    Mission mission = Mission::create(start, items, 100).value();
    const auto pieces = mission.pieces();
    ASSERT_EQ(pieces.size(), 4u);  // to the circle, the circle, from it, the last circle
    EXPECT_NEAR((pieces[0].end - Eigen::Vector2d(1000, 0)).norm(), 0, 1e-9) << "westernmost, northwards, clockwise";
    // The line from the easternmost waypoint touches where sin of the bearing from the centre is radius over distance,
    // to the north of the line between them
    const double exit = std::numbers::pi / 2 - std::acos(200.0 / 1800);
    const Eigen::Vector2d leaves(1000 + 200 * std::cos(exit), 200 + 200 * std::sin(exit));
    EXPECT_NEAR((pieces[1].end - leaves).norm(), 0, 1e-9);
    const double first = std::numbers::pi / 2 + exit,
                 whole = 2 * std::numbers::pi;  // entered heading north, west of it
    double expected = first;
    while (expected < whole * turns) expected += whole;
    EXPECT_NEAR(pieces[1].turn_rad, expected, 1e-9) << turns;
    const auto flight = flown_items(mission, 1000 + 200 * expected + 500);
    ASSERT_GE(flight.size(), 3u);
    EXPECT_NEAR(flight[1].metres, 200 * expected, 8) << "the field's own way around is a little wide of the circle";
  }
}

TEST(Mission, AnOrbitForATimeIsLeftAtItsTangentOnceTheTimeIsUp) {
  const double round_s = 2 * std::numbers::pi * 200 / 25;
  for (const double seconds : {1.0, 70.0, 140.0}) {
    const MissionItem items[] = {
        Orbit{
            .north_m = 1000, .east_m = -200, .height_m = 150, .radius_m = 200, .clockwise = false, .seconds = seconds},
        Waypoint{1000, -2000, 100}};
    Mission mission = Mission::create(start, items, 100).value();
    const auto flight = flown_items(mission, 12000);
    ASSERT_GE(flight.size(), 3u);
    const double on_it_s = flight[1].metres / 25;
    EXPECT_GE(on_it_s, seconds);
    EXPECT_LE(on_it_s, seconds + round_s + 1);
  }
}

TEST(Mission, AnOrbitForEverIsHeldAndEndsTheMission) {
  const MissionItem items[] = {Waypoint{1000, 0, 100},
                               Orbit{.north_m = 1500, .east_m = 0, .height_m = 90, .radius_m = 150}};
  Mission mission = Mission::create(start, items, 100).value();
  const auto flight = flown_items(mission, 20000);
  EXPECT_TRUE(mission.finished());
  EXPECT_GT(flight.back().metres, 18000);
  EXPECT_GT(flight.back().least_north_m, 1500 - 155);
  EXPECT_LT(flight.back().most_north_m, 1500 + 155);
}

TEST(Mission, AnOrbitAroundWhereTheVehicleIsIsFlownOutTo) {
  const MissionItem items[] = {Orbit{.north_m = 5, .east_m = 0, .height_m = 90, .radius_m = 300, .turns = 1},
                               Waypoint{20, 30, 100}, Waypoint{2000, 30, 100}};
  Mission mission = Mission::create(start, items, 100).value();
  const auto flight = flown_items(mission, 20000);
  EXPECT_TRUE(mission.finished()) << "a waypoint within the circle is reached by a turn off it";
  EXPECT_GE(flight[0].metres, 0.9 * 2 * std::numbers::pi * 300) << "angles count, also of the way out";
}

TEST(Mission, WhereSomethingGoesOnItEndsAtItsLastItemWithoutACircle) {
  const MissionItem to_waypoint[] = {Waypoint{1000, 0, 100}, Waypoint{1000, 800, 60}};
  Mission mission = Mission::create(start, to_waypoint, 100, AfterMission::GoesOn).value();
  const MissionPiece& last = mission.pieces().back();
  ASSERT_TRUE(std::holds_alternative<StraightPath>(last.path));
  EXPECT_EQ(last.end, Eigen::Vector2d(1000, 800));
  Navigation now;
  now.north_m = 1000, now.east_m = 700;
  for (int i = 0; i < 3; ++i) mission.piece_at(now, 0);
  EXPECT_FALSE(mission.finished());
  now.east_m = 801;
  mission.piece_at(now, 0);
  EXPECT_TRUE(mission.finished());
  EXPECT_EQ(&mission.piece_at(now, 0), &mission.pieces().back());

  const MissionItem to_orbit[] = {Orbit{.north_m = 500, .east_m = 0, .height_m = 90, .radius_m = 150}};
  const auto never = Mission::create(start, to_orbit, 100, AfterMission::GoesOn);
  ASSERT_FALSE(never);
  EXPECT_NE(never.error().message.find("goes on for ever"), std::string::npos);
}

TEST(Mission, AStartWithACourseIsLeftInIt) {
  for (const double course : {0.0, 1.0, -2.0, 3.0}) {
    const Waypoint from{0, 0, 100, course};
    const MissionItem items[] = {Waypoint{600, 0, 100}, Waypoint{600, 500, 100}};
    const Mission mission = Mission::create(from, items, 100).value();
    const PlannedPoint first = planned_points(mission, 5).front();
    EXPECT_NEAR(std::hypot(first.north_m, first.east_m), 0, 1e-9);
    EXPECT_NEAR(std::remainder(first.course_rad - course, 2 * std::numbers::pi), 0, 1e-9);
    EXPECT_EQ(std::holds_alternative<CirclePath>(mission.pieces()[0].path), course != 0);
  }
}

TEST(Mission, WaypointsWithACourseArePassedExactlyAndInItsDirection) {
  const double course = 1.1518;
  const MissionItem items[] = {Waypoint{400, -250, 70, course}, Waypoint{-400, -50, 70, course},
                               Waypoint{-400, -250, 90, course}, Waypoint{400, -50, 70, course}};
  Mission mission = Mission::create({0, 0, 70, 0.0}, items, 50).value();
  for (std::size_t i = 0; i + 1 < mission.pieces().size(); ++i) {
    const MissionPiece &a = mission.pieces()[i], &b = mission.pieces()[i + 1];
    EXPECT_NEAR((a.end - b.begin).norm(), 0, 1e-6) << "no gap after piece " << i;
  }
  const auto points = planned_points(mission, 5);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const auto &a = points[i - 1], &b = points[i];
    EXPECT_LE(std::abs(std::remainder(b.course_rad - a.course_rad, 2 * std::numbers::pi)), 0.101) << "5 m of 50 m";
    EXPECT_LE(std::abs(b.height_m - a.height_m), 0.5);
    if (a.item == b.item) continue;
    const auto& w = std::get<Waypoint>(items[a.item]);
    EXPECT_NEAR(std::hypot(a.north_m - w.north_m, a.east_m - w.east_m), 0, 1e-6);
    EXPECT_NEAR(std::remainder(a.course_rad - course, 2 * std::numbers::pi), 0, 1e-9);
    EXPECT_NEAR(a.height_m, w.height_m, 1e-9);
  }
  flown_items(mission, 8000);
  EXPECT_TRUE(mission.finished());
}

TEST(Mission, AMixtureRepeatsItsRounds) {
  const MissionItem items[] = {Waypoint{1000, 0, 100},
                               Orbit{.north_m = 1000, .east_m = 1500, .height_m = 150, .radius_m = 200, .turns = 1},
                               Waypoint{-500, 1000, 100, 3.0}, Waypoint{-500, 0, 100, {}, 0.0}};
  Mission mission = Mission::create(start, items, 100, AfterMission::Repeat).value();
  const auto flight = flown_items(mission, 60000);
  EXPECT_FALSE(mission.finished());
  // The same pieces, equally long, in each of the later rounds
  std::vector<std::size_t> begins;
  for (std::size_t i = 1; i < flight.size(); ++i)
    if (flight[i].item == 1 && flight[i - 1].item == 0) begins.push_back(i);
  ASSERT_GE(begins.size(), 5u);
  for (std::size_t r = 2; r + 1 < begins.size(); ++r) {
    ASSERT_EQ(begins[r + 1] - begins[r], begins[2] - begins[1]);
    for (std::size_t i = 0; i < begins[2] - begins[1]; ++i)
      EXPECT_NEAR(flight[begins[r] + i].metres, flight[begins[1] + i].metres, 4) << "round " << r << ", piece " << i;
  }
}

TEST(Mission, APositionThatIsNotANumberPassesNoWaypoint) {
  const MissionItem corners[] = {Waypoint{1000, 0, 100}, Waypoint{1000, 1000, 100}};
  Mission mission = Mission::create(start, corners, 100).value();
  EXPECT_EQ(std::get<StraightPath>(mission.piece_at(at(std::nan(""), 0), 0).path).from, Eigen::Vector2d(0, 0));
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/sim/plan_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {

using Eigen::Vector2d;

class PlanChecks : public testing::Test {
 protected:
  PlanCheck check(std::vector<MissionItem> items, double radius_m = 150) const {
    const Mission mission = Mission::create({0, 0, 100}, items, radius_m).value();
    return check_plan(planned_points(mission, 10), limits,
                      [&](const PlannedPoint& p) -> Result<PlanSurroundings> {
                        return PlanSurroundings{wind, p.height_m};
                      })
        .value();
  }
  FlightLimits limits;
  Vector2d wind = Vector2d::Zero();
};

TEST_F(PlanChecks, WhatCanBeFlownHasNoFindings) {
  const PlanCheck good = check({Waypoint{1000, 0, 120}, Waypoint{1000, 1000, 120}});
  EXPECT_TRUE(good.findings.empty());
  // Two legs less the corner's cut, and its quarter; at 25 m/s
  const double metres = 2 * 850 + 150 * std::numbers::pi / 2;
  EXPECT_NEAR(good.seconds, metres / 25, 1e-6);
}

TEST_F(PlanChecks, ClimbsAreHeldAgainstTheLimitAtTheSpeedOverGround) {
  // 100 m in 1000 at 25 m/s: 2.5 m/s; with 10 m/s behind 3.5; a limit of 3
  const std::vector<MissionItem> items = {Waypoint{1000, 0, 200}, Waypoint{3000, 0, 200}};
  EXPECT_TRUE(check(items).findings.empty());
  wind = {10, 0};
  const auto findings = check(items, 300).findings;
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].item, 0u);
  EXPECT_TRUE(findings[0].impossible);
  EXPECT_NE(findings[0].message.find("a climb of 3.5 m/s"), std::string::npos) << findings[0].message;
  wind = {3, 0};
  ASSERT_EQ(check(items).findings.size(), 1u);
  EXPECT_FALSE(check(items).findings[0].impossible) << "2.8 of 3 m/s: doubtful";
  wind = {0, 0};
  EXPECT_NE(check({Waypoint{1000, 0, 250, {}, {}, 40}, Waypoint{3000, 0, 250}}).findings[0].message.find("6.0 m/s"),
            std::string::npos)
      << "at the airspeed asked for on the way";
}

TEST_F(PlanChecks, TurnsAreHeldAgainstTheBankThatTheyTakeWithTheWindBehind) {
  // 45 degrees at 25 m/s: 63.7 m; with 10 m/s of wind behind 124.9 m
  const auto orbit = [](double radius_m) {
    return std::vector<MissionItem>{Orbit{.north_m = 1000, .east_m = 0, .height_m = 100, .radius_m = radius_m}};
  };
  EXPECT_TRUE(check(orbit(63), 500).findings.at(0).impossible);
  EXPECT_FALSE(check(orbit(65), 500).findings.at(0).impossible);
  EXPECT_TRUE(check(orbit(80), 500).findings.empty());
  wind = {0, 10};
  EXPECT_TRUE(check(orbit(124), 500).findings.at(0).impossible);
  EXPECT_FALSE(check(orbit(126), 500).findings.at(0).impossible);
  const std::string said = check(orbit(124), 500).findings[0].message;
  EXPECT_NE(said.find("a turn of 124 m at 35.0 m/s over ground takes 45 degrees"), std::string::npos) << said;
  const double advised = std::stod(said.substr(said.find("radius of ") + 10));
  EXPECT_TRUE(check(orbit(advised), 500).findings.empty()) << "what is advised can be flown";
  EXPECT_FALSE(check(orbit(advised - 3), 500).findings.empty());
}

TEST_F(PlanChecks, ACornerWithoutRoomForItsArcIsDoubtful) {
  // Half of the second leg is 100 m, of which arcs of 150 m would take 150 at the corner; 63.7 m is the tightest turn.
  const std::vector<MissionItem> items = {Waypoint{1000, 0, 100}, Waypoint{1000, 200, 100}, Waypoint{3000, 400, 100}};
  const auto findings = check(items).findings;
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[0].item, 0u);
  EXPECT_FALSE(findings[0].impossible);
  EXPECT_NE(findings[0].message.find("corner of 90 degrees"), std::string::npos) << findings[0].message;
  EXPECT_NE(findings[0].message.find("at least 64 m off"), std::string::npos) << findings[0].message;
  EXPECT_EQ(findings[1].item, 1u);
  EXPECT_NE(findings[1].message.find("corner of 84 degrees"), std::string::npos) << findings[1].message;
  EXPECT_TRUE(check(items, 99).findings.empty());
  EXPECT_TRUE(
      check({Waypoint{1000, 0, 100}, Waypoint{1050, 10, 100}, Waypoint{3000, 400, 100}}, 10000).findings.empty())
      << "a small corner is flown near its path";
  const auto back = check({Waypoint{1000, 0, 100}, Waypoint{-1000, 0, 100}}).findings;
  ASSERT_EQ(back.size(), 1u);
  EXPECT_NE(back[0].message.find("put a waypoint between"), std::string::npos) << back[0].message;
}

TEST_F(PlanChecks, TheGroundIsMetAlongTheWayNotOnlyAtWaypoints) {
  const auto findings = check({Waypoint{2000, 0, 100}, Waypoint{5000, 0, -10}, Waypoint{8000, 0, 15}}).findings;
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[0].item, 1u);
  EXPECT_TRUE(findings[0].impossible);
  EXPECT_NE(findings[0].message.find("leads 10.0 m under the ground"), std::string::npos) << findings[0].message;
  EXPECT_EQ(findings[1].item, 2u);
  EXPECT_TRUE(findings[1].impossible);
  const auto low = check({Waypoint{2000, 0, 15}}).findings;
  ASSERT_EQ(low.size(), 1u);
  EXPECT_FALSE(low[0].impossible);
  EXPECT_NE(low[0].message.find("comes within 15.0 m of the ground"), std::string::npos);
}

TEST_F(PlanChecks, AWindFasterThanTheAirspeedLeavesNoHeadway) {
  const std::vector<MissionItem> north = {Waypoint{2000, 0, 100, {}, {}, 25}};
  wind = {-26, 0};
  const PlanCheck against = check(north);
  ASSERT_FALSE(against.findings.empty());
  EXPECT_TRUE(against.findings.back().impossible);
  EXPECT_NE(against.findings.back().message.find("leave no headway along the course of"), std::string::npos)
      << against.findings.back().message;
  EXPECT_TRUE(std::isinf(against.seconds));
  EXPECT_LT(ground_speed_mps(25, 0, {0, 26}), 0) << "across it, the course cannot be kept";
  EXPECT_NEAR(ground_speed_mps(25, 0, {0, 15}), 20, 1e-12);
  EXPECT_NEAR(ground_speed_mps(25, 0, {7, 15}), 27, 1e-12);
}

TEST_F(PlanChecks, MotionThatIsKeptOverGroundIsHeldAgainstTheAirspeedAndTheClimbThatItTakes) {
  limits.max_airspeed_mps = 15;
  limits.max_climb_mps = 5;
  // North at 10 m/s over ground for 20 s, in a turn that none of its bank is asked for; then a leg of item 1
  const auto findings = [&](double climb_mps) {
    std::vector<PlannedPoint> points(
        20, {.height_m = 100, .curve_per_m = 0.2, .length_m = 10, .kept = KeptMotion{10, climb_mps, 0, 1}});
    points.push_back({.height_m = 30, .item = 1, .kept = KeptMotion{0, -9, 0, 5}});
    PlanCheck check = check_plan(points, limits, [&](const PlannedPoint& p) -> Result<PlanSurroundings> {
                        return PlanSurroundings{wind, p.height_m};
                      }).value();
    EXPECT_DOUBLE_EQ(check.seconds, 25);
    return check.findings;
  };
  EXPECT_TRUE(findings(4).empty()) << "and descents are no climbs";
  wind = {-3.1, 0};
  EXPECT_TRUE(findings(0).empty()) << "13.1 m/s, short of seven eighths of 15";
  wind = {-3.2, 0};
  ASSERT_EQ(findings(0).size(), 1u);
  EXPECT_FALSE(findings(0)[0].impossible);
  wind = {0, 11.2};
  ASSERT_EQ(findings(0).size(), 1u) << "15.01 m/s across; and 11.2 where it hovers";
  EXPECT_TRUE(findings(0)[0].impossible);
  EXPECT_NE(findings(0)[0].message.find("take an airspeed of 15.0 m/s in a wind of 11.2"), std::string::npos)
      << findings(0)[0].message;
  wind = {6, 0};
  EXPECT_TRUE(findings(0).empty()) << "behind";
  ASSERT_EQ(findings(5.1).size(), 1u);
  EXPECT_TRUE(findings(5.1)[0].impossible);
  EXPECT_NE(findings(5.1)[0].message.find("climb of 5.1 m/s; the vehicle's limit is 5.0 m/s"), std::string::npos)
      << findings(5.1)[0].message;
  EXPECT_FALSE(findings(4.9).at(0).impossible);
}

}  // namespace
}  // namespace nadir::sim

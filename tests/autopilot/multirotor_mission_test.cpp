#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "multirotor_loop.h"
#include "nadir/sim/multirotor_pilot.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

PositionWaypoint at(double north, double east, double height, std::optional<double> hold_s = {},
                    std::optional<double> yaw_rad = {}) {
  return {.at = {north, east, height}, .hold_s = hold_s, .speed_mps = {}, .yaw_rad = yaw_rad};
}

/// The example of the new ROScopter: 20 m of square with a climb and two holds, at 4 m/s.
MultirotorMission example() {
  MultirotorMission mission;
  mission.start = {0, 0, 10};
  mission.waypoints = {at(20, 0, 10, 5), at(20, -20, 20, {}, 1.0), at(0, -20, 20, 10, -2.0), at(0, 0, 40)};
  mission.limits = {.speed_mps = 4, .climb_mps = 2, .descent_mps = 1.5, .acceleration_mps2 = 2};
  return mission;
}

struct Errors {
  double position_m = 0, yaw_rad = 0;
};

Errors fly(const MultirotorMission& mission, const Multirotor& vehicle, const Vector3d& wind, double seconds) {
  MultirotorLoop loop(vehicle, mission.start.height_m, wind);
  MultirotorPilot pilot = MultirotorPilot::create(mission, loop.gains.max_yaw_rate_radps).value();
  Errors worst;
  MultirotorSetpoint asked = loop.home;
  loop.fly(
      seconds, [&](double t) { return asked = pilot.setpoint(t, MultirotorLoop::control_s, false); },
      [&](double t) {
        if (t == 0) return;
        const Vector3d expected = asked.position_ned_m + MultirotorLoop::control_s * asked.velocity_ned_mps;
        worst.position_m = std::max(worst.position_m, (loop.position() - expected).norm());
        worst.yaw_rad = std::max(worst.yaw_rad,
                                 std::abs(std::remainder(loop.now().attitude.yaw_rad - asked.yaw_rad, 2 * 3.14159265)));
      });
  return worst;
}

TEST(MultirotorMission, FollowsItsWaypointsInStillAirAndInWind) {
  struct Row {
    const char* name;
    Multirotor vehicle;
    double still_m, wind_m;
  };
  for (const Row& row :
       {Row{"rosflight", quadrotor(), 0.4, 0.8}, Row{"rosflight_inertia", with_motor_inertia(), 0.7, 1.2},
        Row{"rosflight_sil", pulsed_quadrotor(), 2, 2}, Row{"roscopter", lumped_multirotor(), 2, 2}}) {
    SCOPED_TRACE(row.name);
    const Errors still = fly(example(), row.vehicle, Vector3d::Zero(), 60);
    const Errors wind = fly(example(), row.vehicle, {-8, 0, 0}, 60);
    RecordProperty(fmt::format("{}_still_m", row.name), fmt::format("{:.3f}", still.position_m));
    RecordProperty(fmt::format("{}_wind_m", row.name), fmt::format("{:.3f}", wind.position_m));
    EXPECT_LT(still.position_m, row.still_m);
    EXPECT_LT(wind.position_m, row.wind_m);
    EXPECT_LT(still.yaw_rad, 0.5);
    EXPECT_LT(wind.yaw_rad, 0.5);
  }
}

TEST(MultirotorMission, YawDoesNotChangeTheWay) {
  MultirotorMission straight = example(), turning = example();
  for (PositionWaypoint& w : straight.waypoints) w.yaw_rad.reset();
  turning.face_along = true;
  const Errors a = fly(straight, quadrotor(), {-8, 0, 0}, 60);
  const Errors b = fly(turning, quadrotor(), {-8, 0, 0}, 60);
  EXPECT_NEAR(a.position_m, b.position_m, 0.3);
}

TEST(MultirotorMission, FromTakeOffToLanding) {
  MultirotorMission mission;
  mission.start = {0, 0, 0};
  mission.from_ground = true;
  mission.land = true;
  mission.waypoints = {at(15, 5, 20, 2.0)};
  MultirotorPilot pilot = MultirotorPilot::create(mission, 1).value();
  std::vector<std::string> phases;
  bool on_ground = true;
  double lowest_speed_s = 0;
  for (double t = 0; t < 200 && pilot.phase() != MultirotorPhase::Landed; t += 0.01) {
    const MultirotorSetpoint s = pilot.setpoint(t, 0.01, on_ground);
    on_ground = -s.position_ned_m.z() <= 0;
    if (phases.empty() || phases.back() != to_string(pilot.phase())) phases.push_back(to_string(pilot.phase()));
    if (pilot.phase() == MultirotorPhase::Landing && -s.position_ned_m.z() < 3) {
      EXPECT_NEAR(s.velocity_ned_mps.z(), mission.landing_mps, 1e-9);
      lowest_speed_s += 0.01;
    }
  }
  EXPECT_EQ(phases, (std::vector<std::string>{"standing", "take-off", "mission", "landing", "landed"}));
  EXPECT_NEAR(lowest_speed_s, 3 / mission.landing_mps, 0.1);
  EXPECT_TRUE(pilot.rotors_off());
}

TEST(MultirotorMission, SaysWhatIsWrong) {
  const auto message = [](const MultirotorMission& mission) {
    const auto pilot = MultirotorPilot::create(mission, 1);
    return pilot ? "made" : pilot.error().message;
  };
  MultirotorMission mission = example();
  EXPECT_EQ(message(mission), "made");
  mission.land = mission.repeat = true;
  EXPECT_NE(message(mission).find("does not land"), std::string::npos);
  mission.repeat = false;
  mission.ground_height_m = 15;
  EXPECT_NE(message(mission).find("waypoint 1 is 5.0 m under the ground"), std::string::npos) << message(mission);
  mission.ground_height_m = 0;
  mission.landing_mps = 0;
  EXPECT_NE(message(mission).find("landing speed"), std::string::npos);
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/sim/closed_loop_modes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "autopilot/closed_loop.h"
#include "vehicle/models.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

const Environment flat = Environment::flat(scene_origin);
const Vector3d still_air = Vector3d::Zero();

ClosedLoop loop_with(const std::function<void(FlightGains&)>& change, const FixedWing& vehicle = aerosonde()) {
  return ClosedLoop(flat, 100, still_air, vehicle.cruise_mps, change, vehicle);
}

std::string faults(const std::function<void(FlightGains&)>& change) {
  const auto ok = check_stable(loop_with(change).modes());
  return ok ? "stable" : ok.error().message;
}

TEST(DesignedGains, AreThoseWorkedOutByHandForTheAerosonde) {
  // sim/autopilot's README has the formulas; by hand to two digits.
  const FlightGains g = loop_with({}).gains;
  EXPECT_NEAR(g.autopilot.roll_kp, 1.0, 0.05);
  EXPECT_NEAR(g.autopilot.roll_kd, 0.055, 0.005);
  EXPECT_NEAR(g.autopilot.pitch_kp, 2.0, 0.05);
  EXPECT_NEAR(g.autopilot.pitch_kd, 0.5, 0.05);
  EXPECT_NEAR(g.autopilot.yaw_damper, 0.2, 0.03);
  EXPECT_NEAR(g.autopilot.course_kp, 2.4, 0.1);
  EXPECT_NEAR(g.autopilot.height_kp, 0.35, 0.01);
  EXPECT_NEAR(g.autopilot.airspeed_kp, 0.35, 0.02);
  EXPECT_NEAR(g.path.line_per_m, 0.03, 0.002);
}

TEST(ClosedLoopModes, OfEveryModelAreDampedUnderItsGainsOverItsSpeeds) {
  for (const std::string_view name : fixed_wing_models())
    for (const Control control : {Control::SuccessiveLoops, Control::TotalEnergy})
      for (const double share : {0.85, 1.0, 1.2}) {
        const FixedWing vehicle = fixed_wing_model(name).value();
        const ClosedLoop loop(
            flat, 100, still_air, share * vehicle.cruise_mps, [&](FlightGains& g) { g.autopilot.control = control; },
            vehicle);
        const auto modes = loop.modes();
        ASSERT_GE(modes.size(), 8u);
        double least = 1;
        for (const LoopMode& mode : modes) least = std::min(least, mode.damping());
        EXPECT_LT(modes[0].s_per_s.real(), -0.03) << name << " " << share << " " << modes[0].loop;
        EXPECT_GT(least, 0.25) << name << " " << share;
      }
}

TEST(ClosedLoopModes, DecayAsFlightsDo) {
  // Off a line that is approached slowly, after the faster modes have gone: the path's mode alone is left.
  ClosedLoop loop = loop_with([](FlightGains& g) { g.path.line_per_m = 0.005; });
  double path_rate = 0;
  for (const LoopMode& mode : loop.modes())
    if (mode.loop == "path" && mode.s_per_s.imag() == 0) path_rate = mode.s_per_s.real();
  ASSERT_LT(path_rate, 0);
  const double height_m = loop.now().height_m;
  const StraightPath line{{0, 0.2}, {1, 0.2}, height_m, height_m};
  const auto guide = [&](const Navigation& now) { return follow(line, now, loop.gains.path); };
  const auto off = [&] { return path_error(line, loop.now()).right_m; };
  const auto nothing = [](const Navigation&) {};
  loop.fly(12, guide, nothing);
  const double before = off();
  loop.fly(2, guide, nothing);
  EXPECT_NEAR(std::log(off() / before) / 2, path_rate, 0.02 * std::abs(path_rate));
}

TEST(ClosedLoopModes, UnstableGainsAreNamedByTheirLoop) {
  EXPECT_EQ(faults({}), "stable");
  struct Case {
    std::function<void(FlightGains&)> change;
    std::string_view loop;
  };
  const Case cases[] = {{[](FlightGains& g) { g.autopilot.roll_kp = 12; }, "the roll loop is unstable"},
                        {[](FlightGains& g) { g.autopilot.roll_kp = -1; }, "the roll loop is unstable"},
                        {[](FlightGains& g) { g.autopilot.pitch_kd = 10; }, "the pitch loop is unstable"},
                        {[](FlightGains& g) { g.autopilot.yaw_damper = -2; }, "the yaw damper loop is unstable"},
                        {[](FlightGains& g) { g.autopilot.airspeed_kp = -0.3; }, "the airspeed loop is unstable"},
                        {[](FlightGains& g) { g.path.line_per_m = 1; }, "unstable"},
                        {[](FlightGains& g) { g.autopilot.height_kp = 30; }, "unstable"}};
  for (const Case& c : cases) EXPECT_NE(faults(c.change).find(c.loop), std::string::npos) << c.loop << faults(c.change);
}

TEST(ClosedLoopModes, WhatTheySayUnstableDivergesInFlight) {
  for (const double roll_kp : {4.0, 6.0, 8.0, 10.0, 12.0}) {
    ClosedLoop loop = loop_with([&](FlightGains& g) { g.autopilot.roll_kp = roll_kp; });
    const bool stable = check_stable(loop.modes()).has_value();
    loop.state.body_rates_radps.x() += 1e-4;
    const double height_m = loop.now().height_m;
    double last_rate = 0;
    loop.fly(
        10, [&](const Navigation&) { return Guidance{.height_m = height_m}; },
        [&](const Navigation& now) { last_rate = std::max(0.98 * last_rate, std::abs(now.rates_radps.x())); });
    EXPECT_EQ(last_rate < 1e-4, stable) << roll_kp << " " << last_rate;
  }
}

}  // namespace
}  // namespace nadir::sim

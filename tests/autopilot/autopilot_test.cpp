#include "nadir/sim/autopilot.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>

#include "autopilot/closed_loop.h"
#include "vehicle/models.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

const Environment flat = Environment::flat(scene_origin);
const Environment earth = Environment::wgs84();
const Vector3d still_air = Vector3d::Zero();

/// How a quantity answers to a step in its command, as shares of the step.
struct Response {
  double rise_s = -1;    // until 90 % are reached
  double settled_s = 0;  // from when on it stays within 5 %
  double overshoot = 0;
  double side_height_m = 0, side_airspeed_mps = 0;  // largest errors of the two along the way
};
template <class Guide, class Share>
Response response(ClosedLoop& loop, const Guide& guide, const Share& share) {
  Response r;
  double t = 0;
  const double height_m = loop.now().height_m;
  loop.fly(60, guide, [&](const Navigation& now) {
    const double s = share(now);
    if (r.rise_s < 0 && s >= 0.9) r.rise_s = t;
    if (std::abs(s - 1) > 0.05) r.settled_s = t;
    r.overshoot = std::max(r.overshoot, s - 1);
    r.side_height_m = std::max(r.side_height_m, std::abs(now.height_m - height_m));
    r.side_airspeed_mps = std::max(r.side_airspeed_mps, std::abs(now.airspeed_mps - 25));
    t += steps_per_command * step_s;
  });
  const auto record = [&](const char* name, double value) {
    ::testing::Test::RecordProperty(name, std::to_string(value));
  };
  record("rise_s", r.rise_s), record("settled_s", r.settled_s), record("overshoot", r.overshoot);
  record("side_height_m", r.side_height_m), record("side_airspeed_mps", r.side_airspeed_mps);
  return r;
}

TEST(FeedForward, PointsTheWayThatFlightsNeed) {
  const FeedForward ff = feed_forward(aerosonde(), 25, 1.2682, 9.81).value();
  EXPECT_LT(ff.elevator_per_load, 0) << "a turn needs the nose pulled up";
  EXPECT_GT(ff.throttle_per_climb, 0) << "and a climb more thrust";
  // Of (25/24)^2 - 1, between (1/0.9)^2 - 1 and none: pitch and elevator are almost straight in it
  const auto slower = trim(aerosonde(), {.airspeed_mps = 24}, 1.2682, 9.81);
  const double slow = 25.0 * 25 / (24 * 24) - 1, pitch_rad = slower->pitch_rad - ff.level.pitch_rad,
               elevator_rad = slower->controls.surfaces.elevator_rad - ff.level.controls.surfaces.elevator_rad;
  EXPECT_NEAR(ff.pitch_per_slow * slow / pitch_rad, 1, 0.02);
  EXPECT_NEAR(ff.elevator_per_slow * slow / elevator_rad, 1, 0.02);
  const FeedForward slowest = feed_forward(aerosonde(), 15.35, 1.2682, 9.81).value();
  EXPECT_FALSE(trim(aerosonde(), {.airspeed_mps = 0.9 * 15.35, .climb_angle_rad = -0.05}, 1.2682, 9.81));
  EXPECT_GT(slowest.pitch_per_slow, 0) << "from a faster trim, where there is no slower one";
  EXPECT_FALSE(feed_forward(aerosonde(), 35, 1.2682, 9.81)) << "no level flight there";
}

TEST(Autopilot, InTrimItGivesTheControlsOfTrim) {
  // Attitude comes back from a quaternion in ECEF, where 1e-15 of rounding is divided by the cosine of latitude; the
  // position rounds at 1e-9 m and passes gains of 0.35 / 25 and 2 * 1.6.
  ClosedLoop loop(flat, 100, still_air);
  const Navigation now = loop.now();
  const Controls c = loop.autopilot.step({.course_rad = now.course_rad, .height_m = now.height_m}, now, 0.01);
  EXPECT_NEAR(c.surfaces.elevator_rad, loop.trim_controls().surfaces.elevator_rad, 1e-9);
  EXPECT_NEAR(c.surfaces.aileron_rad, loop.trim_controls().surfaces.aileron_rad, 1e-9);
  EXPECT_NEAR(c.surfaces.rudder_rad, loop.trim_controls().surfaces.rudder_rad, 1e-9);
  EXPECT_NEAR(c.throttle, loop.trim_controls().throttle, 1e-9);
}

// Bounds of responses are the measured figures (recorded in the test's XML, and in the README) with a quarter on top.

TEST(Autopilot, TurnsThirtyDegreesWithoutOvershootAndKeepsItsHeight) {
  ClosedLoop loop(earth, 3000, still_air);
  const double height_m = loop.now().height_m, target = geodesy::to_radians(30);
  const Response r = response(
      loop, [&](const Navigation&) { return Guidance{.course_rad = target, .height_m = height_m}; },
      [&](const Navigation& now) { return now.course_rad / target; });
  EXPECT_GT(r.rise_s, 0);
  EXPECT_LT(r.rise_s, 2.6);
  EXPECT_LT(r.settled_s, 3.3);
  EXPECT_LT(r.overshoot, 0.01);
  EXPECT_LT(r.side_height_m, 0.4);
  EXPECT_LT(r.side_airspeed_mps, 0.07);
}

TEST(Autopilot, ClimbsTwentyMetresWithoutOvershoot) {
  ClosedLoop loop(earth, 3000, still_air);
  const double height_m = loop.now().height_m;
  const Response r = response(
      loop, [&](const Navigation&) { return Guidance{.height_m = height_m + 20}; },
      [&](const Navigation& now) { return (now.height_m - height_m) / 20; });
  EXPECT_GT(r.rise_s, 20 * 0.9 / 3) << "the rate of climb is limited to 3 m/s";
  EXPECT_LT(r.rise_s, 9);
  EXPECT_LT(r.settled_s, 10.8);
  EXPECT_LT(r.overshoot, 0.01);
  EXPECT_LT(r.side_airspeed_mps, 0.33);
}

TEST(Autopilot, RegainsTwoMetresASecondOfAirspeed) {
  ClosedLoop loop(earth, 3000, still_air);
  loop.state.velocity.xyz *= 23.0 / 25;
  const double height_m = loop.now().height_m;
  const Response r = response(
      loop, [&](const Navigation&) { return Guidance{.height_m = height_m}; },
      [&](const Navigation& now) { return (now.airspeed_mps - 23) / 2; });
  EXPECT_GT(r.rise_s, 0);
  EXPECT_LT(r.rise_s, 1.3);
  EXPECT_LT(r.overshoot, 0.02);
  EXPECT_LT(r.settled_s, 1.55);
  EXPECT_LT(r.side_height_m, 0.3);
}

struct MissionErrors {
  double right_m = 0, above_m = 0, airspeed_mps = 0;
};
/// Greatest errors of a flight around the square, from half a minute on.
MissionErrors around_the_square(const Environment& environment, const Vector3d& wind, double height_m = 3000,
                                double airspeed_mps = 25, const std::function<void(FlightGains&)>& change = {},
                                const FixedWing& vehicle = aerosonde(), double seconds = 600) {
  ClosedLoop loop(environment, height_m, wind, airspeed_mps, change, vehicle);
  Mission mission = square(loop.now().height_m, 150);
  MissionErrors worst;
  double t = 0;
  bool turned = false;
  loop.fly(
      seconds, [&](const Navigation& now) { return follow(mission.piece_at(now, 0).path, now, loop.gains.path); },
      [&](const Navigation& now) {
        t += steps_per_command * step_s;
        const Path& path = mission.piece_at(now, 0).path;
        turned |= std::holds_alternative<CirclePath>(path);
        if (t < 30) return;
        const PathError error = path_error(path, now);
        worst.right_m = std::max(worst.right_m, std::abs(error.right_m));
        worst.above_m = std::max(worst.above_m, std::abs(error.above_m));
        worst.airspeed_mps = std::max(worst.airspeed_mps, std::abs(now.airspeed_mps - airspeed_mps));
      });
  EXPECT_TRUE(turned);
  const auto record = [&](const char* name, double value) {
    ::testing::Test::RecordProperty(name, std::to_string(value));
  };
  record("cross_track_m", worst.right_m), record("height_m", worst.above_m), record("airspeed_mps", worst.airspeed_mps);
  return worst;
}

TEST(ClosedLoopMission, ASquareInStillAirIsFlownWithinAMetre) {
  const MissionErrors worst = around_the_square(earth, still_air);
  EXPECT_LT(worst.right_m, 0.9);
  EXPECT_LT(worst.above_m, 0.4);
  EXPECT_LT(worst.airspeed_mps, 0.065);
  EXPECT_GT(worst.right_m, 0.1) << "a flight without error is no flight";
}

TEST(ClosedLoopMission, ASquareInWindOfAThirdOfTheAirspeedIsFlownWithinTwoMetres) {
  const MissionErrors worst = around_the_square(earth, Vector3d(3, -8, 0));
  EXPECT_LT(worst.right_m, 2);
  EXPECT_LT(worst.above_m, 0.68);
  EXPECT_LT(worst.airspeed_mps, 0.1);
}

TEST(ClosedLoopMission, TheGainsHoldFromTwentyToThirtyMetresASecond) {
  // Near the ground, where the air is dense enough for 30 m/s; the gains are those of 25.
  for (const double airspeed : {20.0, 30.0}) {
    const MissionErrors worst = around_the_square(earth, still_air, 200, airspeed);
    EXPECT_LT(worst.right_m, 1.2) << airspeed;
    EXPECT_LT(worst.above_m, 0.5) << airspeed;
    EXPECT_LT(worst.airspeed_mps, 0.1) << airspeed;
  }
}

TEST(ClosedLoopMission, EveryModelFliesTheSquareInWindWithGainsFromItsOwnDerivatives) {
  for (const std::string_view name : fixed_wing_models()) {
    const FixedWing vehicle = fixed_wing_model(name).value();
    const double across_m = name == "junker" ? 3.9 : 1.1;  // whose ailerons turn it at 6 rad/s at most
    for (const Control control : {Control::SuccessiveLoops, Control::TotalEnergy}) {
      const MissionErrors worst = around_the_square(
          earth, Vector3d(2, -4, 0), 300, vehicle.cruise_mps,
          [&](FlightGains& gains) { gains.autopilot.control = control; }, vehicle, 300);
      RecordProperty(std::string(name) + (control == Control::TotalEnergy ? "_energy" : "_loops"),
                     fmt::format("{:.2f} m, {:.2f} m, {:.2f} m/s", worst.right_m, worst.above_m, worst.airspeed_mps));
      EXPECT_LT(worst.right_m, across_m) << name;
      EXPECT_LT(worst.above_m, 0.37) << name;
      EXPECT_LT(worst.airspeed_mps, 0.07) << name;
    }
  }
}

TEST(ClosedLoopMission, TotalEnergyHoldsTheHeightCloserAndTheAirspeedLessSo) {
  const auto flown = [](Control control) {
    return around_the_square(earth, still_air, 3000, 25,
                             [&](FlightGains& gains) { gains.autopilot.control = control; });
  };
  const MissionErrors loops = flown(Control::SuccessiveLoops), energy = flown(Control::TotalEnergy);
  EXPECT_LT(energy.above_m, 0.9 * loops.above_m);
  EXPECT_LT(energy.airspeed_mps, 0.1);
  EXPECT_GT(energy.airspeed_mps, loops.airspeed_mps);
}

TEST(ClosedLoopMission, WindBeyondTheAirspeedBlowsItOffItsPathAndNothingElse) {
  const MissionErrors worst = around_the_square(earth, Vector3d(18, -24, 0));
  EXPECT_GT(worst.right_m, 1000);
  EXPECT_LT(worst.above_m, 1.5) << "45 degrees of bank, again and again";
  EXPECT_LT(worst.airspeed_mps, 0.2);
}

TEST(ClosedLoopMission, TheSameFlightGivesTheSameBits) {
  const auto end = [] {
    ClosedLoop loop(earth, 3000, Vector3d(3, -8, 0));
    Mission mission = square(loop.now().height_m, 150);
    loop.fly(
        60, [&](const Navigation& now) { return follow(mission.piece_at(now, 0).path, now, loop.gains.path); },
        [](const Navigation&) {});
    return to_vector(loop.state);
  };
  const BodyVector a = end(), b = end();
  EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(double) * 13), 0);
}

TEST(ClosedLoopMission, EndsInACircleThatTouchesTheLastWaypoint) {
  ClosedLoop loop(earth, 3000, still_air);
  const double height_m = loop.now().height_m;
  const MissionItem only = Waypoint{500, 0, height_m};
  Mission mission = Mission::create({0, 0, height_m}, {&only, 1}, 150).value();
  const auto guide = [&](const Navigation& now) { return follow(mission.piece_at(now, 0).path, now, loop.gains.path); };
  loop.fly(19, guide, [](const Navigation&) {});
  EXPECT_FALSE(mission.finished());
  loop.fly(30, guide, [](const Navigation&) {});
  EXPECT_TRUE(mission.finished());
  loop.fly(60, guide, [&](const Navigation& now) {
    EXPECT_NEAR(std::hypot(now.north_m - 500, now.east_m - 150), 150, 1);
    EXPECT_NEAR(now.height_m, height_m, 0.5);
  });
}

TEST(Autopilot, IntegratorsDoNotWindUpWhileTheMotorGivesAllItCan) {
  // A minute of climbing after a height out of reach, at full throttle and slower than asked for, then level: the
  // airspeed must not overshoot by what a minute of error would have added, 0.06 * 1 m/s * 60 s = 3.6 of throttle.
  ClosedLoop loop(earth, 3000, still_air, 25, [](FlightGains& gains) { gains.autopilot.max_climb_mps = 9; });
  bool full = false;
  loop.fly(
      60, [](const Navigation& now) { return Guidance{.height_m = now.height_m + 100}; },
      [&](const Navigation& now) { full |= loop.controls.throttle == 1 && now.airspeed_mps < 24; });
  EXPECT_TRUE(full) << "the climb no longer asks for more than there is";
  const double level_m = loop.now().height_m;
  double fastest = 0;
  loop.fly(
      60, [&](const Navigation&) { return Guidance{.height_m = level_m}; },
      [&](const Navigation& now) { fastest = std::max(fastest, now.airspeed_mps); });
  EXPECT_LT(fastest, 27);
  EXPECT_NEAR(loop.now().airspeed_mps, 25, 0.1);
  EXPECT_NEAR(loop.now().height_m, level_m, 0.5);
}

TEST(Autopilot, CommandsStayInTheirLimitsFromAnyAttitude) {
  ClosedLoop loop(flat, 1000, still_air);
  const AutopilotGains& gains = loop.gains.autopilot;
  for (const double yaw : {0.0, 3.0})
    for (const double pitch : {-1.5, 0.0, 1.5707963267948966})
      for (const double roll : {-3.0, 0.0, 1.5707963267948966, 3.0})
        for (const double airspeed : {0.0, 25.0, 200.0}) {
          Navigation now = loop.now();
          now.attitude = {yaw, pitch, roll};
          now.airspeed_mps = airspeed;
          now.rates_radps = {5, -5, 5};
          Autopilot autopilot(feed_forward(aerosonde(), 25, 1.2682, 9.81).value(), gains);
          const Controls c = autopilot.step({.course_rad = 2, .height_m = 5000}, now, 0.01);
          for (const double surface : {c.surfaces.elevator_rad, c.surfaces.aileron_rad, c.surfaces.rudder_rad})
            EXPECT_LE(std::abs(surface), gains.max_surface_rad);  // false for NaN as well
          EXPECT_GE(c.throttle, 0);
          EXPECT_LE(c.throttle, 1);
        }
}

TEST(Autopilot, RecoversFromInvertedFlightAndFromAStandstill) {
  for (const bool inverted : {true, false}) {
    ClosedLoop loop(earth, 3000, still_air);
    const double height_m = loop.now().height_m;
    if (inverted)
      loop.state.ecef_from_body.quaternion = loop.state.ecef_from_body.quaternion * Eigen::Quaterniond(0, 1, 0, 0);
    else
      loop.state.velocity.xyz.setZero();
    loop.fly(
        90, [&](const Navigation&) { return Guidance{.height_m = height_m}; }, [](const Navigation&) {});
    EXPECT_NEAR(loop.now().height_m, height_m, 1) << inverted;
    EXPECT_NEAR(loop.now().airspeed_mps, 25, 0.1) << inverted;
    EXPECT_NEAR(loop.now().course_rad, 0, 0.01) << inverted;
  }
}

TEST(Autopilot, ACourseStraightBehindIsReachedByARightTurnWhateverTheRounding) {
  for (const double off : {-1e-9, 0.0, 1e-9}) {
    ClosedLoop loop(earth, 3000, still_air);
    const Guidance behind{.course_rad = loop.now().course_rad + 3.141592653589793 + off,
                          .height_m = loop.now().height_m};
    loop.fly(
        3, [&](const Navigation&) { return behind; }, [](const Navigation&) {});
    EXPECT_GT(loop.now().attitude.roll_rad, 0.5) << off;
  }
}

}  // namespace
}  // namespace nadir::sim

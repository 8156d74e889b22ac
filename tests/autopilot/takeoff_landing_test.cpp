#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "nadir/sim/gain_design.h"
#include "nadir/sim/landing.h"
#include "nadir/sim/landing_gear.h"
#include "nadir/sim/takeoff.h"
#include "vehicle/aerosonde.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;

const Geodetic origin = Geodetic::degrees(38.1, -0.76, 0);
constexpr double step_s = 1.0 / 400, control_s = 0.01;
constexpr double standing_m = 0.288;  // of the centre of mass over the ground

/// What a flight from standing still to standing still shows.
struct Measured {
  double lift_off_m = 0, lift_off_mps = 0;  // along the runway, airspeed
  double cleared_m = 0;                     // where the climb-out ends
  double takeoff_right_m = 0;               // farthest off the line until there
  double sink_mps = 0, touch_past_m = 0, touch_right_m = 0, touch_mps = 0;
  double touch_yaw_deg = 0, touch_roll_deg = 0;
  double glide_above_m = 0, glide_right_m = 0;  // farthest off the glide below 25 m
  double stop_past_m = 0, stop_right_m = 0;
  std::string crash;
  bool stopped = false;
};

class Circuit {
 public:
  explicit Circuit(const Vector3d& wind_ned, bool launched = false)
      : wind_(wind_ned),
        ground_(ground_for(vehicle_, std::make_shared<PlaneGround>(scene_, 0), environment_)),
        cruise_(feed(25), gains(25)),
        takeoff_({.runway = {.height_m = standing_m}, .launched = launched}, gains(25)),
        landing_plan_{.runway = {.from = {100, 0}, .height_m = standing_m}},
        landing_(landing_plan_, feed(18), gains(18)),
        state_(standing_state(environment_, ground_.gear(), ground_.ground(), origin, 0)) {
    if (launched) {
      state_.position.xyz += 2 * ground_.ground().under(state_.position).normal_ecef;
      state_.ecef_from_body.quaternion =
          geodesy::ecef_from_ned(origin).rotation * geodesy::quaternion_from({0, 0.2, 0});
      state_.velocity.xyz = geodesy::ecef_from_ned(origin).rotation * (Vector3d(14, 0, -1) + wind_ned);
    }
  }

  Measured fly() {
    const auto gates = approach(landing_plan_, 300);
    const double turn_m = gates[0].north_m - 400;
    const MissionItem waypoints[] = {Waypoint{600, 0, 50},
                                     Waypoint{600, 400, 50},
                                     Waypoint{turn_m, 400, 50},
                                     Waypoint{turn_m, 0, 50},
                                     gates[0],
                                     gates[1]};
    Mission mission = Mission::create({0, 0, 20}, waypoints, 100).value();
    Measured out;
    bool landing = false;
    for (long i = 0; i < 400 * 400 && !out.stopped && out.crash.empty(); ++i) {
      const double time_s = static_cast<double>(i) * step_s;
      if (i % 4 == 0) {
        const Navigation now = true_navigation(state_, environment_, wind_, scene_);
        const GroundSense sense{now.height_m - standing_m, contact_.touching != 0};
        if (!takeoff_.done()) {
          command_ = takeoff_.step(cruise_, now, sense, control_s);
          if (!out.lift_off_m && !sense.on_ground && sense.height_m > 0.1)
            out.lift_off_m = now.north_m, out.lift_off_mps = now.airspeed_mps;
          out.takeoff_right_m = std::max(out.takeoff_right_m, std::abs(now.east_m));
          out.cleared_m = now.north_m;
        } else if (!mission.finished()) {
          command_ = {cruise_.step(follow(mission.piece_at(now, 0).path, now, {}), now, control_s), {}};
        } else {
          command_ = landing_.step(now, sense, control_s);
          landing = true;
          if (landing_.phase() == Landing::Phase::Glide && sense.height_m < 25) {
            const PathError off = landing_.off_glide(now);
            out.glide_above_m = std::max(out.glide_above_m, std::abs(off.above_m));
            out.glide_right_m = std::max(out.glide_right_m, std::abs(off.right_m));
          }
          if (landing_.phase() == Landing::Phase::Stopped) {
            out.stopped = true;
            out.stop_past_m = landing_plan_.runway.past_m(now), out.stop_right_m = landing_plan_.runway.right_m(now);
          }
        }
      }
      const auto next = advance(vehicle_, environment_, ground_, state_, contact_, command_.controls, command_.gear,
                                wind_, time_s, step_s, work_);
      if (!next) {
        out.crash = next.error().message;
        break;
      }
      state_ = next->state, contact_ = next->contact;
      const auto name = [&](int point) { return ground_.gear().points()[static_cast<std::size_t>(point)].name; };
      if (next->report.part) out.crash = name(next->report.part->point) + " touches";
      if (next->report.broken) out.crash = name(next->report.broken->point) + " breaks";
      if (landing && next->report.met) {
        if (out.sink_mps == 0) {
          const Navigation now = true_navigation(state_, environment_, wind_, scene_);
          out.touch_past_m = landing_plan_.runway.past_m(now), out.touch_right_m = landing_plan_.runway.right_m(now);
          out.touch_mps = now.airspeed_mps;
          out.touch_yaw_deg = geodesy::to_degrees(std::remainder(now.attitude.yaw_rad, 2 * std::numbers::pi));
          out.touch_roll_deg = geodesy::to_degrees(now.attitude.roll_rad);
        }
        out.sink_mps = std::max(out.sink_mps, next->report.impact_mps);
      }
    }
    return out;
  }

 private:
  FeedForward feed(double airspeed_mps) const { return feed_forward(vehicle_, airspeed_mps, 1.2682, 9.81).value(); }
  AutopilotGains gains(double airspeed_mps) const {
    return designed_gains(vehicle_, feed(airspeed_mps).level, 1.2682, 9.81).autopilot;
  }

  Vector3d wind_;
  FixedWing vehicle_ = aerosonde();
  Environment environment_ = Environment::flat(origin);
  geodesy::LocalFrame scene_{origin};
  FixedWingGround ground_;
  Autopilot cruise_;
  Takeoff takeoff_;
  LandingPlan landing_plan_;
  Landing landing_;
  FixedWingState state_;
  ContactState contact_;
  ContactWork work_;
  PilotCommand command_;
};

void record(const char* name, double value) { testing::Test::RecordProperty(name, fmt::format("{:.2f}", value)); }

/// Takes off to the north, flies a circuit, and lands 100 m north of where it stood. The measured values are in the
/// test's XML and in the README.
class TakeoffAndLanding : public testing::Test {
 protected:
  Measured fly(const Vector3d& wind_ned, bool launched = false) {
    const Measured m = Circuit(wind_ned, launched).fly();
    EXPECT_EQ(m.crash, "");
    EXPECT_TRUE(m.stopped);
    record("lift_off_m", m.lift_off_m), record("lift_off_mps", m.lift_off_mps), record("cleared_m", m.cleared_m);
    record("takeoff_right_m", m.takeoff_right_m);
    record("glide_above_m", m.glide_above_m), record("glide_right_m", m.glide_right_m);
    record("sink_mps", m.sink_mps), record("touch_past_m", m.touch_past_m), record("touch_right_m", m.touch_right_m);
    record("touch_mps", m.touch_mps), record("touch_yaw_deg", m.touch_yaw_deg);
    record("touch_roll_deg", m.touch_roll_deg);
    record("stop_past_m", m.stop_past_m), record("stop_right_m", m.stop_right_m);
    EXPECT_LT(m.glide_above_m, 0.1);
    EXPECT_LT(m.glide_right_m, 0.3);
    EXPECT_NEAR(m.touch_mps, 18, 0.3);
    return m;
  }
};

TEST(GroundRollGainsOfAGear, TakeItsWheelbase) {
  EXPECT_NEAR(ground_roll_gains(*fixed_wing_model("aerosonde")->gear).wheelbase_m, 0.5 + 0.07, 1e-12);
  EXPECT_NEAR(ground_roll_gains(*fixed_wing_model("anaconda")->gear).wheelbase_m, 0.35 + 0.06, 1e-12);
  const auto wheel = [](double forward_m, double steering) {
    return ContactPoint{.name = "wheel",
                        .kind = ContactPoint::Kind::Wheel,
                        .body_m = {forward_m, 0, 0.2},
                        .stiffness_npm = 1000,
                        .steering = steering};
  };
  // A tail wheel, steered the other way; front and rear wheels steered against each other: half of their distance
  EXPECT_NEAR(
      ground_roll_gains(ContactGear::create({wheel(0.1, 0), wheel(0.1, 0), wheel(-0.8, -1)}).value()).wheelbase_m, 0.9,
      1e-12);
  EXPECT_NEAR(ground_roll_gains(ContactGear::create({wheel(0.5, 1), wheel(-0.5, -1)}).value()).wheelbase_m, 0.5, 1e-12);
  EXPECT_EQ(ground_roll_gains(ContactGear::create({wheel(0.5, 0), wheel(-0.5, 0)}).value()).wheelbase_m,
            GroundRollGains{}.wheelbase_m);
}

TEST_F(TakeoffAndLanding, InStillAir) {
  const Measured m = fly({0, 0, 0});
  EXPECT_NEAR(m.lift_off_m, 44, 3);
  EXPECT_LT(m.takeoff_right_m, 0.5);
  EXPECT_NEAR(m.sink_mps, 0.35, 0.05);
  EXPECT_NEAR(m.touch_past_m, 0, 2);
  EXPECT_NEAR(m.touch_right_m, 0, 0.3);
  EXPECT_LT(m.stop_past_m, 70);
}

TEST_F(TakeoffAndLanding, LaunchedAtFourteenMetresASecond) {
  const Measured m = fly({0, 0, 0}, true);
  EXPECT_LT(m.cleared_m, 170);
  EXPECT_NEAR(m.sink_mps, 0.35, 0.05);
}

TEST_F(TakeoffAndLanding, AgainstFiveMetresASecondOfWind) {
  const Measured m = fly({-5, 0, 0});
  EXPECT_NEAR(m.lift_off_m, 27, 3) << "shorter than in still air";
  EXPECT_NEAR(m.sink_mps, 0.35, 0.05);
  EXPECT_NEAR(m.touch_past_m, 0, 2);
}

TEST_F(TakeoffAndLanding, WithThreeMetresASecondOfWindBehind) {
  const Measured m = fly({3, 0, 0});
  EXPECT_NEAR(m.lift_off_m, 56, 4) << "longer than in still air";
  EXPECT_NEAR(m.sink_mps, 0.35, 0.05);
  EXPECT_NEAR(m.touch_past_m, 0, 3);
}

TEST_F(TakeoffAndLanding, InFiveMetresASecondAcross) {
  for (const double east : {-5.0, 5.0}) {
    const Measured m = fly({0, east, 0});
    EXPECT_LT(m.takeoff_right_m, 5) << east;
    EXPECT_NEAR(m.sink_mps, 0.45, 0.15) << east;
    EXPECT_NEAR(m.touch_past_m, 0, 9) << east;
    EXPECT_NEAR(m.touch_right_m, 0, 3) << east;
    EXPECT_NEAR(m.touch_yaw_deg, 0, 5) << east;  // 16 degrees of crab before it aligns
    EXPECT_NEAR(m.touch_roll_deg, 0, 12) << east;
  }
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/sim/multirotor_control.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "multirotor_loop.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

struct Kind {
  const char* name;
  Multirotor vehicle;
};
std::vector<Kind> kinds() {
  return {{"rosflight", quadrotor()},
          {"rosflight_inertia", with_motor_inertia()},
          {"rosflight_sil", pulsed_quadrotor()},
          {"roscopter", lumped_multirotor()}};
}

/// How a quantity answers a step: when it has come 90 % of the way, and how far it goes beyond.
struct Response {
  double rise_s = -1, overshoot_share = 0, left_share = 0;
  void see(double t, double share) {
    if (rise_s < 0 && share >= 0.9) rise_s = t;
    overshoot_share = std::max(overshoot_share, share - 1);
    left_share = std::abs(share - 1);
  }
};

Response step_of(const Multirotor& vehicle, double seconds, const MultirotorSetpoint& step,
                 const std::function<double(const MultirotorLoop&)>& share) {
  MultirotorLoop loop(vehicle);
  MultirotorSetpoint setpoint = loop.home;
  setpoint.position_ned_m += step.position_ned_m;
  setpoint.yaw_rad = step.yaw_rad;
  Response response;
  loop.fly(
      seconds, [&](double) { return setpoint; }, [&](double t) { response.see(t, share(loop)); });
  return response;
}

TEST(MultirotorControl, StepsOfPositionHeightAndYaw) {
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    const Response level = step_of(kind.vehicle, 40, {.position_ned_m = {10, 0, 0}},
                                   [](const MultirotorLoop& l) { return l.now().north_m / 10; });
    const Response up = step_of(kind.vehicle, 40, {.position_ned_m = {0, 0, -5}},
                                [](const MultirotorLoop& l) { return (l.now().height_m - 50) / 5; });
    const Response yaw = step_of(kind.vehicle, 40, {.yaw_rad = pi / 2}, [](const MultirotorLoop& l) {
      return std::remainder(l.now().attitude.yaw_rad, 2 * pi) / (pi / 2);
    });
    const std::string name = kind.name;
    for (const auto& [what, response] : {std::pair("level", level), std::pair("up", up), std::pair("yaw", yaw)}) {
      SCOPED_TRACE(what);
      RecordProperty(fmt::format("{}_{}_rise_s", name, what), fmt::format("{:.2f}", response.rise_s));
      RecordProperty(fmt::format("{}_{}_overshoot_percent", name, what),
                     fmt::format("{:.1f}", 100 * response.overshoot_share));
      EXPECT_GT(response.rise_s, 0);
      EXPECT_LT(response.rise_s, 12);
      EXPECT_LT(response.overshoot_share, 0.08);
      EXPECT_LT(response.left_share, 0.005);
    }
  }
}

TEST(MultirotorControl, HoverInTrimAsksForTheControlsOfTrim) {
  for (const Kind& kind : kinds()) {
    MultirotorLoop loop(kind.vehicle);
    // Where rotors carry unequal shares, the mixer's torque in proportion to thrust is not that of the pulses
    const bool unequal = std::string(kind.name) == "rosflight_sil";
    const double tolerance = unequal ? 1e-3 : 1e-6;
    const auto hover =
        trim(kind.vehicle, {}, MultirotorLoop::density, MultirotorLoop::gravity, 0).value().controls.actuators;
    loop.fly(
        1, [&](double) { return loop.home; },
        [&](double t) {
          if (t > 0) {
            EXPECT_NEAR((loop.controls.actuators - hover).abs().maxCoeff(), 0, 1e-6) << kind.name;
          }
        });
    EXPECT_NEAR((loop.position() - loop.home.position_ned_m).norm(), 0, tolerance) << kind.name;
  }
}

TEST(MultirotorControl, WindIsLearntAndYawGoesItsOwnWay) {
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    MultirotorLoop loop(kind.vehicle, 50, {8, -3, 0});
    double worst = 0, worst_yaw = 0;
    loop.fly(
        60,
        [&](double t) {
          MultirotorSetpoint s = loop.home;
          s.yaw_rad = std::remainder(0.3 * t, 2 * pi);
          s.yaw_rate_radps = 0.3;
          return s;
        },
        [&](double t) {
          if (t < 20) return;
          worst = std::max(worst, (loop.position() - loop.home.position_ned_m).norm());
          worst_yaw = std::max(worst_yaw, std::abs(std::remainder(loop.now().attitude.yaw_rad - 0.3 * t, 2 * pi)));
        });
    RecordProperty(fmt::format("{}_turning_in_wind_m", kind.name), fmt::format("{:.3f}", worst));
    EXPECT_LT(worst, 0.6);
    EXPECT_LT(worst_yaw, 0.15);
  }
}

TEST(MultirotorControl, ComesBackFromAnyAttitude) {
  for (const Kind& kind : kinds())
    for (const double roll : {0.8, 1.6, 2.5, pi}) {
      SCOPED_TRACE(fmt::format("{} {}", kind.name, roll));
      MultirotorLoop loop(kind.vehicle, 200);
      loop.state.ecef_from_body.quaternion =
          loop.state.ecef_from_body.quaternion * geodesy::quaternion_from({0.5, 0.2, roll});
      loop.state.body_rates_radps = {1, -2, 0.5};
      loop.fly(
          40, [&](double) { return loop.home; }, [](double) {});
      EXPECT_NEAR((loop.position() - loop.home.position_ned_m).norm(), 0, 0.2);
    }
}

TEST(MultirotorControl, AFailedRotorOrABrokenEstimateGivesNoNumbersThatAreNone) {
  for (const Kind& kind : kinds()) {
    MultirotorLoop loop(kind.vehicle, 500);
    loop.fly(
        8, [&](double) { return loop.home; }, [](double) {},
        [](MultirotorControls& controls) { controls.actuators[0] = 0; });
    EXPECT_TRUE(loop.controls.actuators.isFinite().all()) << kind.name;
    EXPECT_TRUE(to_vector(loop.state).allFinite()) << kind.name;
    EXPECT_LT(loop.now().height_m, 500);
  }
}

TEST(MultirotorControl, ARequestBeyondAllLimitsSaturatesAndIsForgotten) {
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(kind.name);
    MultirotorLoop loop(kind.vehicle, 50);
    bool saturated = false;
    MultirotorSetpoint far = loop.home;
    far.position_ned_m += Vector3d(3000, -3000, -500);
    far.yaw_rad = 3;
    double fastest = 0, steepest = 0;
    loop.fly(
        10, [&](double) { return far; },
        [&](double) {
          saturated = saturated || loop.control.saturated();
          fastest = std::max(fastest, loop.now().ground_speed_mps);
          const auto& a = loop.now().attitude;
          steepest = std::max(steepest, std::acos(std::cos(a.pitch_rad) * std::cos(a.roll_rad)));
        });
    EXPECT_LT(fastest, 1.1 * loop.gains.max_speed_mps);
    EXPECT_LT(steepest, loop.gains.max_tilt_rad + 0.15);
    // Back to where it is now: it stops there and does not swing
    MultirotorSetpoint here = loop.home;
    here.position_ned_m = loop.position() + Vector3d(30, -30, -5);
    loop.fly(
        60, [&](double) { return here; }, [](double) {});
    EXPECT_NEAR((loop.position() - here.position_ned_m).norm(), 0, 0.1);
    if (kind.vehicle.lumped) {
      EXPECT_TRUE(saturated);
    }
  }
}

TEST(MultirotorControl, GainsThatCannotBeAreRefused) {
  const Multirotor vehicle = pulsed_quadrotor();
  const Mixer mixer = Mixer::create(vehicle, 1.225).value();
  MultirotorGains gains = multirotor_gains(vehicle, 0.01, 1.225, 9.81).value();
  EXPECT_TRUE(check(gains, mixer, 0.01, 9.81));
  EXPECT_FALSE(check(gains, mixer, 0.2, 9.81)) << "control that comes too seldom";
  gains.rate_per_s *= 20;
  gains.tilt_per_s *= 20;
  const auto fast = check(gains, mixer, 0.01, 9.81);
  ASSERT_FALSE(fast);
  EXPECT_NE(fast.error().message.find("not stable"), std::string::npos);
  gains.rate_per_s = -1;
  EXPECT_FALSE(check(gains, mixer, 0.01, 9.81));

  Multirotor heavy = quadrotor();
  heavy.mass = MassProperties::create(14, {.jxx_kgm2 = 1, .jyy_kgm2 = 1, .jzz_kgm2 = 1}).value();
  const auto none = multirotor_gains(heavy, 0.01, 1.225, 9.81);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("nothing to steer with"), std::string::npos);
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/sim/multirotor_trim.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include "vehicle/models.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;

constexpr double density = 1.225, gravity = 9.81;
const Geodetic origin = Geodetic::degrees(38.1, -0.76, 0);

TEST(MultirotorTrim, ComesToTheSameFlightFromAnyStart) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-1.5, 1.5), share(0.1, 3);
  for (const Multirotor& vehicle : {quadrotor(), pulsed_quadrotor(), lumped_multirotor()})
    for (const MultirotorTrimTarget& target :
         {MultirotorTrimTarget{}, MultirotorTrimTarget{10, 0, 0}, MultirotorTrimTarget{3, -4, 1}}) {
      const auto first = trim(vehicle, target, density, gravity, 0);
      ASSERT_TRUE(first) << first.error().message;
      EXPECT_LT(first->residual, 1e-9);
      for (int i = 0; i < 20; ++i) {
        const auto again = trim(vehicle, target, density, gravity, 0, {angle(random), angle(random), share(random)});
        ASSERT_TRUE(again) << again.error().message;
        EXPECT_NEAR(again->roll_rad, first->roll_rad, 1e-8);
        EXPECT_NEAR(again->pitch_rad, first->pitch_rad, 1e-8);
        EXPECT_NEAR((again->controls.actuators - first->controls.actuators).abs().maxCoeff(), 0, 1e-8);
      }
    }
}

TEST(MultirotorTrim, LeansIntoTheWay) {
  const Multirotor vehicle = quadrotor();
  const auto t = trim(vehicle, {.forward_mps = 10}, density, gravity, 0);
  ASSERT_TRUE(t) << t.error().message;
  EXPECT_LT(t->pitch_rad, -0.1);
  EXPECT_NEAR(t->roll_rad, 0, 0.02) << "rotors that turn against each other feel the same air";
  const auto sideways = trim(vehicle, {.right_mps = 5}, density, gravity, 0);
  EXPECT_GT(sideways->roll_rad, 0.05);
}

TEST(MultirotorTrim, AMinuteOfHandsOffHoverStaysWhereItIs) {
  const Environment flat = Environment::flat(origin, gravity, density);
  for (const Multirotor& vehicle : {quadrotor(), pulsed_quadrotor(), lumped_multirotor()}) {
    const Vector3d wind(3, -2, 0);
    const auto t = trim(vehicle, {}, density, gravity, 0);
    ASSERT_TRUE(t);
    MultirotorState state = trimmed_state(vehicle, *t, flat, origin, 0.4, wind, 0);
    const Vector3d start = state.position.xyz;
    for (int i = 0; i < 10 * 400; ++i)
      state = advance(vehicle, flat, state, t->controls, wind, i / 400.0, 1.0 / 400).value();
    const Vector3d moved = flat.at(state.position).ecef_from_ned.transpose() * (state.position.xyz - start);
    EXPECT_NEAR((moved - 10 * wind).norm(), 0, 1e-5) << "carried along by the wind, and by nothing else";
  }
}

TEST(MultirotorTrim, SaysWhyThereIsNone) {
  const auto message = [](const Multirotor& vehicle, const MultirotorTrimTarget& target, double charge_ah = 0) {
    const auto t = trim(vehicle, target, density, gravity, charge_ah);
    return t ? "found" : t.error().message;
  };
  Multirotor heavy = quadrotor();
  heavy.mass = MassProperties::create(20, {.jxx_kgm2 = 1, .jyy_kgm2 = 1, .jzz_kgm2 = 1}).value();
  EXPECT_NE(message(heavy, {}).find("needs a throttle of rotor"), std::string::npos) << message(heavy, {});
  EXPECT_NE(message(quadrotor(), {.climb_mps = 40}).find("steady flight at"), std::string::npos);
  EXPECT_NE(message(quadrotor(), {.forward_mps = std::nan("")}).find("finite"), std::string::npos);
  Multirotor battery = quadrotor();
  battery.battery = lithium_polymer(6, 5, 0.02);
  EXPECT_NE(message(battery, {}, 0).find("battery is empty"), std::string::npos);
  EXPECT_EQ(message(battery, {}, 5), "found");
}

}  // namespace
}  // namespace nadir::sim

// Numbers worked out by hand from the published equations and parameters, g = 9.81, rho = 1.225, each to its printed
// digits: the tolerance is half a unit of the last one (a quarter of the weight, 8.58375 N, lies right on it).
#include <gtest/gtest.h>

#include "nadir/sim/multirotor_trim.h"
#include "vehicle/models.h"

namespace nadir::sim {
namespace {

constexpr double density = 1.225, gravity = 9.81;

TEST(MultirotorOracle, HoverOfThePublishedMotorsAndPropellers) {
  const auto t = trim(quadrotor(), {}, density, gravity, 0);
  ASSERT_TRUE(t) << t.error().message;
  EXPECT_LT(t->residual, 1e-9);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(t->controls.actuators[i], 0.47992, 0.5e-5);
    EXPECT_NEAR(t->output.omega_radps[i], 387.81, 0.5e-2);
    EXPECT_NEAR(t->output.thrust_n[i], 8.5838, 0.5001e-4);
    EXPECT_NEAR(t->output.torque_nm[i], 0.1606, 0.5e-4);
  }
}

TEST(MultirotorOracle, FullThrottleAtRest) {
  const RotorOutput full = settled_output(quadrotor().rotors[0], 1, 0, density);
  EXPECT_NEAR(full.omega_radps, 793.5, 0.5e-1);
  EXPECT_NEAR(full.thrust_n, 35.94, 0.5e-2);
  EXPECT_NEAR(full.torque_nm, 0.672, 0.5e-3);
}

TEST(MultirotorOracle, ThePublishedGroundEffect) {
  const geodesy::Geodetic origin = geodesy::Geodetic::degrees(38.1, -0.76, 0);
  const Environment flat = Environment::flat(origin, gravity, density);
  Multirotor vehicle = quadrotor();
  vehicle.ground_effect = {.law = GroundEffect::Law::Polynomial,
                           .force_n = {-55.3516, 181.8265, -203.9874, 85.3735, -7.6619}};
  struct Row {
    double height_m, force_n;
  };
  for (const Row& row : {Row{0, 0}, Row{0.1, 0}, Row{0.2, 2.62}, Row{0.3, 4.05}, Row{0.5, 3.30}, Row{0.8, 0.51},
                         Row{1.0, 0.20}, Row{1.2, 0.46}, Row{1.5, 0}}) {
    MultirotorState state;
    state.position = geodesy::ecef_from_geodetic(origin);
    state.ecef_from_body.quaternion = Eigen::Quaterniond(flat.at(state.position).ecef_from_ned);
    const MultirotorControls off{RotorValues::Zero(4)};
    const double lift = -output(vehicle, flat, state, off, AirMotion{}, row.height_m).loads.force_body_n.z();
    EXPECT_NEAR(lift, row.force_n, 0.5e-2) << row.height_m;
  }
}

/// The other two sets carry their weight as their quadratics and limits say.
TEST(MultirotorOracle, HoverOfTheOtherSets) {
  const auto sil = trim(pulsed_quadrotor(), {}, density, gravity, 0);
  ASSERT_TRUE(sil) << sil.error().message;
  for (int i = 0; i < 4; ++i) {
    const double pulse_us = 1000 + 1000 * sil->controls.actuators[i];
    EXPECT_NEAR(1.5e-5 * pulse_us * pulse_us - 0.024451 * pulse_us + 9.00225, sil->output.thrust_n[i], 1e-9);
    EXPECT_NEAR(2.22e-7 * pulse_us * pulse_us - 3.51e-4 * pulse_us + 0.12531, sil->output.torque_nm[i], 1e-9);
  }
  EXPECT_NEAR(sil->output.thrust_n.sum() * 0.99939157, 2.0 * gravity, 0.05) << "axes lean by 2 degrees";

  const auto simple = trim(lumped_multirotor(), {}, density, gravity, 0);
  ASSERT_TRUE(simple) << simple.error().message;
  EXPECT_NEAR(simple->controls.actuators[0], 3.69 * gravity / 59.844, 1e-9);
}

}  // namespace
}  // namespace nadir::sim

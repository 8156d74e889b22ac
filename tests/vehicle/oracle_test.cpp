// Numbers worked out by hand from the published equations and parameters, g = 9.81, rho = 1.2682, each to its printed
// digits: the tolerance is half a unit of the last one.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "nadir/geodesy/geodetic.h"
#include "nadir/sim/fixed_wing.h"
#include "nadir/sim/trim.h"
#include "vehicle/aerosonde.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
constexpr double density = 1.2682, gravity = 9.81;

TEST(AerosondeOracle, StallBlend) {
  const FixedWing vehicle = aerosonde();
  EXPECT_NEAR(stall_blend(vehicle, 0), 0.000000, 0.5e-6);
  EXPECT_NEAR(stall_blend(vehicle, 0.2), 0.000001, 0.5e-6);
  EXPECT_NEAR(stall_blend(vehicle, 0.47), 0.500000, 0.5e-6);
  EXPECT_NEAR(stall_blend(vehicle, 0.6), 0.998499, 0.5e-6);
}

TEST(AerosondeOracle, ForcesAtTwentyFiveMetresASecond) {
  const double alpha = 0.05;
  const AirData air = air_data_from(25 * Vector3d(std::cos(alpha), 0, std::sin(alpha)));
  const Loads l = aerodynamics(aerosonde(), air, Vector3d::Zero(), {.elevator_rad = -0.1}, density);
  const double fx = l.force_body_n.x(), fz = l.force_body_n.z();
  EXPECT_NEAR(fx * std::sin(alpha) - fz * std::cos(alpha), 108.4410, 0.5e-4) << "lift";
  EXPECT_NEAR(-fx * std::cos(alpha) - fz * std::sin(alpha), 10.3964, 0.5e-4) << "drag";
  EXPECT_NEAR(fx, -4.9637, 0.5e-4);
  EXPECT_NEAR(fz, -108.8251, 0.5e-4);
  EXPECT_NEAR(l.moment_body_nm.y(), -1.0143, 0.5e-4);
  EXPECT_EQ(l.force_body_n.y(), 0);
  EXPECT_EQ(l.moment_body_nm.x(), 0);
}

TEST(AerosondeOracle, MotorInFlightAndAtRest) {
  const FixedWingPropulsion motor = aerosonde().propulsion;
  struct Row {
    double throttle, airspeed, omega, thrust, thrust_digit, torque;
  };
  for (const Row& row : {Row{0.5, 25, 340.95, -12.432, 1e-3, -0.4989}, Row{0.75, 25, 499.59, 7.917, 1e-3, 0.5240},
                         Row{1.0, 25, 655.68, 37.774, 1e-3, 1.8096}, Row{0.5, 0, 330.12, 21.816, 1e-3, 0.6194},
                         Row{1.0, 0, 649.95, 84.563, 1e-3, 2.4011}, Row{0.0, 25, 0, -22.6, 0.1, 0}}) {
    const PropulsionOutput out = propel(motor, row.throttle, row.airspeed, density);
    SCOPED_TRACE(row.throttle);
    EXPECT_NEAR(out.thrust_n, row.thrust, row.thrust_digit / 2);
    if (row.throttle == 0) continue;  // printed as a thrust only
    EXPECT_NEAR(out.omega_radps, row.omega, 0.5e-2);
    EXPECT_NEAR(out.torque_nm, row.torque, 0.5e-4);
  }
}

/// The oracle is of the plane of symmetry: the propeller's reaction, which costs a little aileron, is not in it.
TEST(AerosondeOracle, LevelTrim) {
  const auto t = trim(aerosonde(), {.airspeed_mps = 25}, density, gravity);
  ASSERT_TRUE(t) << t.error().message;
  EXPECT_LT(t->residual, 1e-9);
  EXPECT_NEAR(geodesy::to_degrees(t->alpha_rad), 2.8476, 0.5e-4);
  EXPECT_NEAR(t->controls.surfaces.elevator_rad, -0.12392, 0.5e-5);
  EXPECT_NEAR(t->controls.throttle, 0.77354, 0.5e-5);
  EXPECT_NEAR(t->propeller.omega_radps, 514.39, 0.5e-2);
  EXPECT_NEAR(2 * std::numbers::pi * 25 / (t->propeller.omega_radps * 0.508), 0.6011, 0.5e-4) << "advance ratio";
  EXPECT_NEAR(t->propeller.thrust_n, 10.330, 0.5e-3);
  EXPECT_NEAR(t->propeller.torque_nm, 0.6340, 0.5e-4);
}

TEST(AerosondeOracle, LevelTrimWithoutParasiticDrag) {
  FixedWing vehicle = aerosonde();
  vehicle.drag.zero = 0;
  const auto t = trim(vehicle, {.airspeed_mps = 25}, density, gravity);
  ASSERT_TRUE(t) << t.error().message;
  EXPECT_NEAR(t->alpha_rad, 0.05011, 0.5e-5);
  EXPECT_NEAR(t->controls.surfaces.elevator_rad, -0.12504, 0.5e-5);
  EXPECT_NEAR(t->controls.throttle, 0.6768, 0.5e-4);
  EXPECT_NEAR(t->propeller.thrust_n, 0.954, 0.5e-3);
}

TEST(AerosondeOracle, ThirtyFiveMetresASecondNeedMoreThanFullThrottle) {
  const auto t = trim(aerosonde(), {.airspeed_mps = 35}, density, gravity);
  ASSERT_FALSE(t);
  EXPECT_NE(t.error().message.find("throttle of 1.079"), std::string::npos) << t.error().message;
}

/// The oracle has no stall: one far from where it flies.
TEST(AnacondaOracle, LevelTrimWithoutStall) {
  FixedWing vehicle = fixed_wing_model("anaconda").value();
  vehicle.stall_alpha_rad = 1.5;
  struct Row {
    double airspeed, alpha_deg, elevator, throttle, thrust;
  };
  for (const Row& row : {Row{15, 0.7695, 0.09919, 0.50595, 4.356}, Row{17, -0.6532, 0.16792, 0.56762, 5.105}}) {
    const auto t = trim(vehicle, {.airspeed_mps = row.airspeed}, density, gravity);
    ASSERT_TRUE(t) << t.error().message;
    EXPECT_NEAR(geodesy::to_degrees(t->alpha_rad), row.alpha_deg, 0.5e-4);
    EXPECT_NEAR(t->controls.surfaces.elevator_rad, row.elevator, 0.5e-5);
    EXPECT_NEAR(t->controls.throttle, row.throttle, 0.5e-5);
    EXPECT_NEAR(t->propeller.thrust_n, row.thrust, 0.5e-3);
  }
}

TEST(MyTwinDreamOracle, LevelTrimWithEitherSlipstreamAndMass) {
  struct Row {
    double mass_kg, full_speed, alpha, elevator, throttle;
  };
  for (const Row& row : {Row{3.92, 30, 0.03569, 0.02165, 0.6894}, Row{3.92, 40, 0.03569, 0.02165, 0.5171},
                         Row{1.5, 30, -0.02319, 0.03413, 0.6576}}) {
    FixedWing vehicle = fixed_wing_model("my_twin_dream").value();
    vehicle.mass =
        MassProperties::create(row.mass_kg, {.jxx_kgm2 = 0.213, .jyy_kgm2 = 0.171, .jzz_kgm2 = 0.350, .jxz_kgm2 = 0.04})
            .value();
    std::get<Slipstream>(vehicle.propulsion).full_speed_mps = row.full_speed;
    const auto t = trim(vehicle, {.airspeed_mps = 16.38}, density, gravity);
    ASSERT_TRUE(t) << t.error().message;
    EXPECT_NEAR(t->alpha_rad, row.alpha, 0.5e-5);
    EXPECT_NEAR(t->controls.surfaces.elevator_rad, row.elevator, 0.5e-5);
    EXPECT_NEAR(t->controls.throttle, row.throttle, 0.5e-4);
  }
}

}  // namespace
}  // namespace nadir::sim

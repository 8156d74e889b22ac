// What a stall changes: forces and moments far beyond it, and the motions that follow.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nadir/sim/fixed_wing.h"
#include "nadir/sim/trim.h"
#include "vehicle/aerosonde.h"
#include "vehicle/models.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
constexpr double density = 1.2682, gravity = 9.81, pi = std::numbers::pi;

Loads at(const FixedWing& vehicle, double alpha_rad, const Vector3d& rates = Vector3d::Zero(), double airspeed = 20) {
  AirData air;
  air.airspeed_mps = airspeed;
  air.alpha_rad = alpha_rad;
  air.sin_alpha = std::sin(alpha_rad);
  air.cos_alpha = std::cos(alpha_rad);
  return aerodynamics(vehicle, air, rates, {}, density);
}

TEST(Stall, LoadsAreContinuousAtEveryAngleAndOverStraightBehind) {
  // Steps of 1e-4 rad change coefficients by at most their steepest slope, that of the blend, M/4 of the lift of 3 that
  // it takes away: 40 per radian, and moments by the slope of its own.
  for (const std::string_view name : fixed_wing_models()) {
    const FixedWing vehicle = fixed_wing_model(name).value();
    const double newtons = 0.5 * density * 400 * vehicle.wing_area_m2;
    double steepest_force = 0, steepest_moment = 0;
    constexpr int steps = 62832;
    const auto angle = [](int i) { return std::remainder(i * (2 * pi / steps), 2 * pi); };
    for (int i = 0; i < steps; ++i) {
      const Loads a = at(vehicle, angle(i), {1, 1, 1}), b = at(vehicle, angle(i + 1), {1, 1, 1});
      ASSERT_TRUE(a.force_body_n.allFinite() && a.moment_body_nm.allFinite()) << name << " " << angle(i);
      steepest_force = std::max(steepest_force, (b.force_body_n - a.force_body_n).norm() / newtons);
      steepest_moment =
          std::max(steepest_moment, (b.moment_body_nm - a.moment_body_nm).norm() / newtons / vehicle.span_m);
    }
    EXPECT_LT(steepest_force, 1e-4 * 60) << name;
    EXPECT_LT(steepest_moment, 1e-4 * 20) << name;
    EXPECT_LT((at(vehicle, pi, {1, 1, 1}).force_body_n - at(vehicle, -pi, {1, 1, 1}).force_body_n).norm(),
              1e-9 * newtons);
    EXPECT_LT((at(vehicle, pi, {1, 1, 1}).moment_body_nm - at(vehicle, -pi, {1, 1, 1}).moment_body_nm).norm(),
              1e-9 * newtons);
  }
}

TEST(Stall, LoadsAreContinuousBroadsideWhereAlphaIsNone) {
  // All ways of the air within 1e-3 rad of the wing's: alpha takes every value there.
  for (const std::string_view name : fixed_wing_models()) {
    FixedWing vehicle = fixed_wing_model(name).value();
    const double newtons = 0.5 * density * 400 * vehicle.wing_area_m2;
    const auto from = [&](double side_mps, double alpha_rad, double off_rad) {
      const Vector3d v(std::abs(side_mps) * off_rad * std::cos(alpha_rad), side_mps,
                       std::abs(side_mps) * off_rad * std::sin(alpha_rad));
      return aerodynamics(vehicle, air_data_from(v), {1, 1, 1}, {0.2, 0.1, 0.1}, density);
    };
    for (const double side_mps : {20.0, -20.0}) {
      const Loads broadside = from(side_mps, 0, 0);
      EXPECT_NEAR(broadside.force_body_n.x(), 0, 1e-12) << name;
      EXPECT_NEAR(broadside.force_body_n.z(), 0, 1e-12) << name;
      for (double alpha_rad = -pi; alpha_rad < pi; alpha_rad += 0.05) {
        const Loads near = from(side_mps, alpha_rad, 1e-3);
        EXPECT_LT((near.force_body_n - broadside.force_body_n).norm() / newtons, 4e-3) << name << " " << alpha_rad;
        EXPECT_LT((near.moment_body_nm - broadside.moment_body_nm).norm() / newtons / vehicle.span_m, 4e-3)
            << name << " " << alpha_rad;
      }
    }
    vehicle.stall_model = StallModel::Lift;
    EXPECT_GT((from(20, 1, 1e-3).force_body_n - from(20, -2, 1e-3).force_body_n).norm() / newtons, 1) << name;
  }
}

TEST(Stall, ASideslipOfFlightLeavesThePublishedModelAsItIs) {
  FixedWing published = aerosonde();
  published.stall_model = StallModel::Lift;
  const AirData air = air_data_from(20 * Vector3d(std::cos(0.17), std::sin(0.17), 0));
  const Vector3d rates = Vector3d::Zero();
  const Loads a = aerodynamics(aerosonde(), air, rates, {}, density),
              b = aerodynamics(published, air, rates, {}, density);
  EXPECT_LT((a.force_body_n - b.force_body_n).norm(), 1e-3 * b.force_body_n.norm());
  EXPECT_LT((a.moment_body_nm - b.moment_body_nm).norm(), 1e-3 * b.moment_body_nm.norm());
}

TEST(Stall, ThePublishedModelJumpsBehindAndStaysLinear) {
  FixedWing vehicle = aerosonde();
  vehicle.stall_model = StallModel::Lift;
  const double moment_nm = 0.5 * density * 400 * vehicle.wing_area_m2 * vehicle.chord_m;
  EXPECT_NEAR(at(vehicle, 1.2).moment_body_nm.y(), moment_nm * (0.0135 - 2.74 * 1.2), 1e-9);
  EXPECT_GT((at(vehicle, pi).moment_body_nm - at(vehicle, -pi).moment_body_nm).norm(), moment_nm);
}

TEST(Stall, BroadsideTheDragIsThatOfAPlateAndTheNoseIsPulledIntoTheAir) {
  const FixedWing vehicle = aerosonde();
  const double newtons = 0.5 * density * 400 * vehicle.wing_area_m2;
  const Loads falling = at(vehicle, pi / 2);
  EXPECT_NEAR(-falling.force_body_n.z() / newtons, 2 + vehicle.drag.zero, 1e-9);
  EXPECT_NEAR(falling.force_body_n.x(), 0, 1e-9 * newtons) << "a plate has no force along itself";
  // Centre of pressure at half the chord, a quarter behind the mass, and the tail's share.
  EXPECT_NEAR(falling.moment_body_nm.y() / newtons / vehicle.chord_m, 0.0135 - 2.74 - 0.25 * 2, 1e-9);
}

TEST(Stall, AttachedFlowKnowsNothingOfIt) {
  // At 0.05 rad the blend is 7.6e-10; a roll of 0.05 in b p / 2 Va is short of the derivative by (0.025)^2 / 3 = 2e-4.
  FixedWing published = aerosonde();
  published.stall_model = StallModel::Lift;
  const Vector3d roll(2 * 20 * 0.05 / published.span_m, 0, 0);
  const Loads a = at(aerosonde(), 0.05), b = at(published, 0.05);
  EXPECT_LT((a.force_body_n - b.force_body_n).norm(), 1e-8 * b.force_body_n.norm());
  EXPECT_LT((a.moment_body_nm - b.moment_body_nm).norm(), 1e-7 * b.moment_body_nm.norm());
  const double damped = at(aerosonde(), 0.05, roll).moment_body_nm.x(),
               linear = at(published, 0.05, roll).moment_body_nm.x();
  EXPECT_NEAR(damped / linear, 1 - 0.025 * 0.025 / 3, 1e-6);
}

TEST(Stall, RollIsDampedBeforeItAndDrivenBeyondItUpToARateOfItsOwn) {
  const FixedWing vehicle = aerosonde();
  const auto moment = [&](double alpha, double rate) { return at(vehicle, alpha, {rate, 0, 0}).moment_body_nm.x(); };
  EXPECT_LT(moment(0.3, 0.5), 0);
  EXPECT_GT(moment(vehicle.stall_alpha_rad, 0.5), 0) << "autorotation";
  EXPECT_LT(moment(vehicle.stall_alpha_rad, -0.5), 0) << "the same to the other side";
  EXPECT_LT(moment(vehicle.stall_alpha_rad, 40), 0) << "until the rising wing has its lift back";
}

/// Held in a stall with the rudder pushed, from trim; ten seconds at 400 Hz.
struct Spin {
  double highest_alpha_rad = 0, most_roll_radps = 0, turned_rad = 0;
};
Spin held_in_stall(const FixedWing& vehicle, double airspeed) {
  const Environment flat = Environment::flat({}, gravity, density);
  const geodesy::Geodetic place{0, 0, 3000};
  Controls controls = trim(vehicle, {.airspeed_mps = airspeed}, flat, place).value().controls;
  FixedWingState state =
      trimmed_state(trim(vehicle, {.airspeed_mps = airspeed}, flat, place).value(), flat, place, 0, Vector3d::Zero());
  controls.throttle = 0;
  Spin spin;
  for (int i = 0; i < 4000; ++i) {
    const double t_s = i / 400.0;
    controls.surfaces.elevator_rad = std::max(-vehicle.max_deflection_rad, controls.surfaces.elevator_rad - 0.3 / 400);
    if (t_s > 2) controls.surfaces.rudder_rad = -0.4;
    state = advance(vehicle, flat, state, controls, Vector3d(Vector3d::Zero()), t_s, 1 / 400.0).value();
    const AirData air = body_in_air(state, flat, Vector3d(Vector3d::Zero())).flow;
    spin.highest_alpha_rad = std::max(spin.highest_alpha_rad, air.alpha_rad);
    spin.most_roll_radps = std::max(spin.most_roll_radps, std::abs(state.body_rates_radps.x()));
    spin.turned_rad += state.body_rates_radps.norm() / 400;
  }
  return spin;
}

TEST(Stall, AnAircraftHeldInItWithRudderEntersASpin) {
  FixedWing vehicle = fixed_wing_model("my_twin_dream").value();
  const Spin spin = held_in_stall(vehicle, 16);
  EXPECT_GT(spin.highest_alpha_rad, vehicle.stall_alpha_rad);
  EXPECT_GT(spin.most_roll_radps, 2);
  EXPECT_LT(spin.most_roll_radps, 40) << "autorotation has a rate of its own";
  EXPECT_GT(spin.turned_rad, 2 * pi);
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/sim/landing_gear.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nadir/sim/trim.h"
#include "vehicle/aerosonde.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;

const Geodetic origin = Geodetic::degrees(38.1, -0.76, 0);

/// An Aerosonde on or over the ground.
struct Parked {
  explicit Parked(const Environment& of, std::shared_ptr<const Ground> on)
      : environment(of), ground(ground_for(vehicle, std::move(on), environment)) {
    state = standing_state(environment, ground.gear(), ground.ground(), origin, 0.3);
  }
  static Parked flat() {
    return Parked(Environment::flat(origin), std::make_shared<PlaneGround>(geodesy::LocalFrame(origin), 0));
  }
  static Parked wgs84() { return Parked(Environment::wgs84(), std::make_shared<EllipsoidGround>(0)); }

  ContactReport step(double dt_s = 0.0025) {
    const auto next =
        advance(vehicle, environment, ground, state, contact, controls, gear, wind, time_s, dt_s, work).value();
    time_s += dt_s;
    state = next.state;
    contact = next.contact;
    return next.report;
  }
  double height_m() const { return ground.ground().under(state.position).height_m; }

  FixedWing vehicle = aerosonde();
  Environment environment;
  FixedWingGround ground;
  FixedWingState state;
  ContactState contact;
  ContactWork work;
  Controls controls;
  GearCommand gear;
  Vector3d wind = Vector3d::Zero();
  double time_s = 0;
};

TEST(LandingGear, AnAerosondeStandsOnItForAnHour) {
  for (Parked parked : {Parked::flat(), Parked::wgs84()}) {
    parked.wind = {-3, 2, 0};
    for (int i = 0; i < 2000; ++i) parked.step();
    EXPECT_TRUE(parked.contact.resting);
    EXPECT_EQ(parked.contact.touching, 0b111u);
    EXPECT_NEAR(parked.height_m(), 0.3 - 0.0118, 0.002);  // less what lift carries
    const FixedWingState settled = parked.state;
    for (int i = 0; i < 3600 * 400; ++i) parked.step();
    EXPECT_EQ(parked.state.position.xyz, settled.position.xyz);
    EXPECT_TRUE(parked.contact.resting);
  }
}

TEST(LandingGear, BothEarthsDropAlike) {
  // 0.3 m of fall bounce and settle the same over the ellipsoid that turns as over the plane.
  double heights_m[2];
  int i = 0;
  for (Parked parked : {Parked::flat(), Parked::wgs84()}) {
    parked.state.position.xyz += 0.3 * parked.ground.ground().under(parked.state.position).normal_ecef;
    double impact_mps = 0;
    for (int k = 0; k < 3000; ++k) impact_mps = std::max(impact_mps, parked.step().impact_mps);
    EXPECT_NEAR(impact_mps, std::sqrt(2 * 9.8 * 0.3), 0.04);  // the nose wheel's, thrown down by the main wheels
    EXPECT_TRUE(parked.contact.resting);
    heights_m[i++] = parked.height_m();
  }
  EXPECT_NEAR(heights_m[0], heights_m[1], 1e-4);
}

TEST(LandingGear, ThrottleRollsAndBrakesHold) {
  Parked parked = Parked::flat();
  parked.gear.brake = 1;
  parked.controls.throttle = 0.3;
  for (int i = 0; i < 2000; ++i) parked.step();
  EXPECT_LT(parked.state.velocity.xyz.norm(), 1e-3);
  parked.gear.brake = 0;
  for (int i = 0; i < 800; ++i) parked.step();
  EXPECT_GT(parked.state.velocity.xyz.norm(), 0.5);
}

TEST(LandingGear, TheNoseWheelSteersToTheRight) {
  Parked parked = Parked::flat();
  parked.state.velocity.xyz = parked.state.ecef_from_body.quaternion * Vector3d(3, 0, 0);
  parked.gear.steering_rad = 0.1;
  for (int i = 0; i < 200; ++i) parked.step();
  // Ackermann: v / wheelbase * tan(angle), less what the tyres slip by
  const double ackermann = parked.state.velocity.xyz.norm() / 0.57 * std::tan(0.1);
  EXPECT_NEAR(parked.state.body_rates_radps.z(), ackermann, 0.15 * ackermann);
}

TEST(LandingGear, AWingTipThatTouchesIsToldOfByName) {
  Parked parked = Parked::flat();
  parked.state.ecef_from_body.quaternion =
      geodesy::ecef_from_ned(origin).rotation * geodesy::quaternion_from({0, 0, 0.5});
  parked.state.position.xyz += 0.5 * parked.ground.ground().under(parked.state.position).normal_ecef;
  ContactReport report;
  while (!report.part && parked.time_s < 2) report = parked.step();
  ASSERT_TRUE(report.part);
  EXPECT_EQ(parked.ground.gear().points()[static_cast<std::size_t>(report.part->point)].name, "right wing tip");
}

TEST(GroundEffect, TakesInducedDragAsMcCormickHasIt) {
  const FixedWing vehicle = aerosonde();
  // 16 h/b of 1, 2 and 8: 1/2, 4/5, 64/65
  EXPECT_DOUBLE_EQ(ground_effect(vehicle, vehicle.span_m / 16), 0.5);
  EXPECT_DOUBLE_EQ(ground_effect(vehicle, vehicle.span_m / 8), 0.8);
  EXPECT_DOUBLE_EQ(ground_effect(vehicle, vehicle.span_m / 2), 64.0 / 65);
  EXPECT_EQ(ground_effect(vehicle, 2 * vehicle.span_m), 1);
  EXPECT_GT(ground_effect(vehicle, 1.999 * vehicle.span_m), 0.999);
  FixedWing without = vehicle;
  without.feels_ground = false;
  EXPECT_EQ(ground_effect(without, 0.1), 1);

  const AirData air = air_data_from({20, 0, 2});
  const auto drag_n = [&](double height_m) {
    const Vector3d f = aerodynamics(vehicle, air, Vector3d::Zero(), {}, 1.225, height_m).force_body_n;
    return -f.dot(air.velocity_body_mps) / air.airspeed_mps;
  };
  const double lift = 0.23 + 5.61 * air.alpha_rad;
  const double aspect = vehicle.span_m * vehicle.span_m / vehicle.wing_area_m2;
  const double induced_n = 0.5 * 1.225 * 404 * 0.55 * lift * lift / (std::numbers::pi * 0.9 * aspect);
  EXPECT_NEAR(drag_n(no_ground_m) - drag_n(vehicle.span_m / 16), induced_n / 2, 1e-7) << "but for what has stalled";
}

}  // namespace
}  // namespace nadir::sim

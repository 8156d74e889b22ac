#include "nadir/sim/fixed_wing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "nadir/sim/step.h"
#include "nadir/sim/trim.h"
#include "vehicle/aerosonde.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;

const Geodetic origin = Geodetic::degrees(38.1, -0.76, 0);
const Environment flat = Environment::flat(origin);
constexpr double step_s = 1.0 / 400;
const Vector3d still_air = Vector3d::Zero();

Trim cruise() { return trim(aerosonde(), {.airspeed_mps = 25}, flat, origin).value(); }
FixedWingState cruising(double yaw_rad = 0) { return trimmed_state(cruise(), flat, origin, yaw_rad, still_air); }

FixedWingState fly(FixedWingState state, const Environment& environment, const Controls& controls, const Vector3d& wind,
                   double seconds, double dt_s = step_s) {
  const FixedWing vehicle = aerosonde();
  const int steps = static_cast<int>(std::lround(seconds / dt_s));
  for (int i = 0; i < steps; ++i) state = advance(vehicle, environment, state, controls, wind, i * dt_s, dt_s).value();
  return state;
}

Vector3d in_ned(const FixedWingState& state) { return (geodesy::ecef_from_ned(origin).inverse() * state.position).xyz; }

/// Body rates a moment after one control was moved from trim.
Vector3d rates_after(void (*move)(Controls&)) {
  Controls controls = cruise().controls;
  move(controls);
  return fly(cruising(), flat, controls, still_air, 0.1).body_rates_radps;
}

TEST(FixedWing, ElevatorDownLowersTheNose) {
  EXPECT_LT(rates_after([](Controls& c) { c.surfaces.elevator_rad += 0.05; }).y(), -0.05);
  EXPECT_GT(rates_after([](Controls& c) { c.surfaces.elevator_rad -= 0.05; }).y(), 0.05);
}

TEST(FixedWing, PositiveAileronRollsRight) {
  EXPECT_GT(rates_after([](Controls& c) { c.surfaces.aileron_rad += 0.05; }).x(), 0.1);
  EXPECT_LT(rates_after([](Controls& c) { c.surfaces.aileron_rad -= 0.05; }).x(), -0.1);
}

TEST(FixedWing, PositiveRudderTurnsTheNoseLeft) {
  EXPECT_LT(rates_after([](Controls& c) { c.surfaces.rudder_rad += 0.05; }).z(), -0.03);
  EXPECT_GT(rates_after([](Controls& c) { c.surfaces.rudder_rad -= 0.05; }).z(), 0.03);
}

TEST(FixedWing, ThrottleSpeedsUpAndTheReactionRollsLeft) {
  Controls more = cruise().controls;
  more.throttle = 1;
  const FixedWingState state = fly(cruising(), flat, more, still_air, 1);
  // (37.8 - 10.3) N on 11 kg for a second, less what drag grows by.
  EXPECT_NEAR(body_in_air(state, flat, still_air).flow.airspeed_mps - 25, 2.5, 0.5);
  EXPECT_LT(rates_after([](Controls& c) { c.throttle = 1; }).x(), -0.05);
}

TEST(FixedWing, WindFromTheRightDriftsItToTheLeft) {
  // Northbound with the air moving west at 5 m/s: carried along with it from the start, and the nose stays north.
  const Vector3d wind(0, -5, 0);
  const FixedWingState start = trimmed_state(cruise(), flat, origin, 0, wind);
  EXPECT_NEAR(body_in_air(start, flat, wind).flow.beta_rad, 0, 1e-12);
  const Vector3d p = in_ned(fly(start, flat, cruise().controls, wind, 10));
  EXPECT_NEAR(p.x(), 250, 0.01);
  EXPECT_NEAR(p.y(), -50, 0.01);
  EXPECT_NEAR(p.z(), 0, 0.01);
}

TEST(FixedWing, WindFromTheRightPushesOnTheRightWhicheverWayItHeads) {
  for (const double yaw : {0.0, 1.0, 2.5, 4.0}) {
    const FixedWingState state = cruising(yaw);
    const Vector3d to_the_left(5 * std::sin(yaw), -5 * std::cos(yaw), 0);
    EXPECT_GT(body_in_air(state, flat, to_the_left).flow.beta_rad, 0.19) << yaw;
    EXPECT_LT(loads(aerosonde(), flat, state, cruise().controls, to_the_left).force_body_n.y(), -10) << yaw;
  }
}

TEST(FixedWing, WindOnlyCarriesTheFlightAlong) {
  // Over the flat Earth the air is an inertial frame of its own: the same flight in it, moved by the wind. Positions of
  // 5e6 m round at 1e-9 m, and 800 steps gather less than 1e-6 m.
  const Vector3d wind(3, -7, 1);
  Controls controls = cruise().controls;
  controls.surfaces.aileron_rad += 0.01;
  const FixedWingState in_air = fly(cruising(0.7), flat, controls, still_air, 2);
  const FixedWingState in_wind = fly(trimmed_state(cruise(), flat, origin, 0.7, wind), flat, controls, wind, 2);
  EXPECT_NEAR((in_ned(in_wind) - in_ned(in_air) - 2 * wind).norm(), 0, 1e-6);
  EXPECT_NEAR(in_wind.ecef_from_body.quaternion.angularDistance(in_air.ecef_from_body.quaternion), 0, 1e-7);
}

TEST(FixedWing, AirThatRollsRightRollsItRightAndAirThatTurnsWithItDampsNothing) {
  const FixedWing vehicle = aerosonde();
  const FixedWingState still = cruising(1.5);  // heading east: forward is east
  const Vector3d ahead(std::cos(1.5), std::sin(1.5), 0);
  const auto moment = [&](const FixedWingState& state, const Vector3d& rates_ned) {
    return loads(vehicle, flat, state, cruise().controls, AirMotion(still_air, rates_ned)).moment_body_nm;
  };
  EXPECT_GT(moment(still, 0.3 * ahead).x() - moment(still, still_air).x(), 1) << "Clp 0.25 rho V S b^2 p = 5.6 N m";

  const Vector3d turning_ned(0.2, -0.1, 0.05);
  FixedWingState turning = still;
  turning.body_rates_radps =
      still.ecef_from_body.quaternion.conjugate() * (geodesy::ecef_from_ned(origin).rotation * turning_ned);
  EXPECT_GT((moment(turning, still_air) - moment(still, still_air)).norm(), 0.5);
  EXPECT_LT((moment(turning, turning_ned) - moment(still, still_air)).norm(), 1e-9);
}

TEST(FixedWing, EachStageOfAStepHasTheAirOfItsMoment) {
  // A gust that builds up evenly over 20 ms: in steps of 20 ms and of 2.5 ms within what the method errs, (h rate)^5 of
  // rates over 120, 1e-3 of the change, where air held over the step would be off by half of the change.
  const AirOverTime air(0, still_air, 0.02, Vector3d(0, 0, -3));
  const FixedWing vehicle = aerosonde();
  const auto flown = [&](int steps) {
    FixedWingState state = cruising();
    for (int i = 0; i < steps; ++i)
      state = advance(vehicle, flat, state, cruise().controls, air, i * 0.02 / steps, 0.02 / steps).value();
    return state.velocity.xyz;
  };
  const Vector3d before = cruising().velocity.xyz;
  const double change = (flown(64) - before).norm();
  EXPECT_GT(change, 0.05);
  EXPECT_LT((flown(1) - flown(64)).norm(), 1e-2 * change);
  EXPECT_LT((flown(8) - flown(64)).norm(), 1e-5 * change);
}

TEST(FixedWing, StaysFiniteAtAndNearZeroAirspeed) {
  const FixedWing vehicle = aerosonde();
  for (const double speed : {0.0, 1e-300, 1e-12, 1e-3, 1.0})
    for (const Vector3d& way :
         {Vector3d(1, 0, 0), Vector3d(-1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, -1), Vector3d(-1, -1, 1)})
      for (const double throttle : {0.0, 1.0}) {
        FixedWingState state = cruising();
        state.velocity.xyz = state.ecef_from_body.quaternion * (speed * way);
        const Controls controls{{0.1, -0.1, 0.1}, throttle};
        EXPECT_TRUE(derivative(vehicle, flat, to_vector(state), controls.surfaces, throttle, still_air).allFinite())
            << speed << " " << way.transpose();
        EXPECT_TRUE(to_vector(fly(state, flat, controls, still_air, 20)).allFinite())
            << speed << " " << way.transpose();
      }
}

TEST(FixedWing, AirLoadsFadeToNothingWithAirspeed) {
  // Quadratic in airspeed but for the damping of rates, which is linear: at 1e-6 m/s at most 1e-6 N s/m of it.
  const FixedWing vehicle = aerosonde();
  for (const Vector3d& way : {Vector3d(1, 0, 0), Vector3d(-1, 1e-3, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
    const Loads l = aerodynamics(vehicle, air_data_from(1e-6 * way), Vector3d(1, 1, 1), {0.3, 0.3, 0.3}, 1.2);
    EXPECT_LT(l.force_body_n.norm(), 1e-5);
    EXPECT_LT(l.moment_body_nm.norm(), 1e-5);
  }
}

TEST(FixedWing, ServosFollowWithTheirLagAndStopAtTheirLimits) {
  // One time constant after a step a first-order lag stands at 1 - 1/e, exactly, in eight steps or in one.
  Controls controls = cruise().controls;
  const Surfaces from = controls.surfaces;
  controls.surfaces = {from.elevator_rad + 0.01, from.aileron_rad + 0.01, from.rudder_rad + 0.01};
  const double expected = 0.01 * (1 - std::exp(-1));
  for (const double dt : {step_s, 0.02}) {
    const Surfaces now = fly(cruising(), flat, controls, still_air, 0.02, dt).surfaces;
    EXPECT_NEAR(now.elevator_rad - from.elevator_rad, expected, 1e-15);
    EXPECT_NEAR(now.aileron_rad - from.aileron_rad, expected, 1e-15);
    EXPECT_NEAR(now.rudder_rad - from.rudder_rad, expected, 1e-15);
  }

  const double limit = aerosonde().max_deflection_rad;
  controls.surfaces = {9, -9, 9};
  const Surfaces end = fly(cruising(), flat, controls, still_air, 0.5).surfaces;
  EXPECT_NEAR(end.elevator_rad, limit, 1e-10);
  EXPECT_NEAR(end.aileron_rad, -limit, 1e-10);
  EXPECT_NEAR(end.rudder_rad, limit, 1e-10);
}

TEST(FixedWing, ThrottleBeyondItsLimitsIsItsLimits) {
  const FixedWingState state = cruising();
  EXPECT_EQ(derivative(aerosonde(), flat, to_vector(state), state.surfaces, 7, still_air),
            derivative(aerosonde(), flat, to_vector(state), state.surfaces, 1, still_air));
}

TEST(FixedWing, APropellerIsNotTurnedBackwardsByFriction) {
  EXPECT_EQ(propel(aerosonde().propulsion, 0, 0, 1.2).omega_radps, 0);
  EXPECT_EQ(propel(aerosonde().propulsion, 0, 0, 1.2).thrust_n, 0);
}

TEST(FixedWing, ABodyWithoutAirKeepsEnergyAndAngularMomentum) {
  // No density: no force but gravity, no moment. A tumbling throw keeps m v^2/2 + m g h, and its angular momentum in
  // space. RK4 at 2.5 ms and 3 rad/s: (w dt)^5/120 = 2e-13 a step, 4000 steps: 1e-9 at most.
  const Environment vacuum = Environment::flat(origin, 9.81, 0);
  const FixedWing v = aerosonde();
  FixedWingState state = cruising();
  state.body_rates_radps = {2, -1.5, 1};
  const auto energy = [&](const FixedWingState& s) {
    return v.mass.mass_kg() * (0.5 * s.velocity.xyz.squaredNorm() + 9.81 * vacuum.at(s.position).height_m);
  };
  const auto momentum = [&](const FixedWingState& s) {
    return Vector3d(s.ecef_from_body.quaternion * (v.mass.inertia_kgm2() * s.body_rates_radps));
  };
  const double energy_before = energy(state);
  const Vector3d momentum_before = momentum(state);
  const FixedWingState after = fly(state, vacuum, {}, still_air, 10);
  // 10 s of fall exchange 53 kJ; 490 m of height round at 1e-9 m.
  EXPECT_NEAR(energy(after), energy_before, 1e-5);
  EXPECT_NEAR((momentum(after) - momentum_before).norm(), 0, 1e-8);
}

TEST(FixedWing, OverTheTurningEarthAFallIsDeflectedToTheEast) {
  // From rest, 10 s: x = w g cos(lat) t^3 / 3 eastwards, to first order in w t = 7e-4.
  const Environment vacuum = Environment::wgs84(-300000);  // the sea that far below: hardly any air
  FixedWingState state;
  state.position = geodesy::ecef_from_geodetic(origin);
  const double g = vacuum.at(state.position).gravity_ecef_mps2.norm();
  state.ecef_from_body.quaternion = geodesy::ecef_from_ned(origin).rotation;
  const Vector3d p = in_ned(fly(state, vacuum, {}, still_air, 10));
  const double east = 7.292115e-5 * g * std::cos(origin.lat_rad) * 1000 / 3;
  EXPECT_NEAR(p.y(), east, 2e-3 * east);
  EXPECT_NEAR(p.z(), 0.5 * g * 100, 0.5 * g * 100 * 2e-4)
      << "gravity weakens by 1.5e-4 over the fall, on average half that";
}

TEST(FixedWing, AStepKeepsTheQuaternionOfUnitLength) {
  Controls controls = cruise().controls;
  controls.surfaces.aileron_rad = 0.3;
  FixedWingState state = cruising();
  for (int i = 0; i < 4000; ++i) {
    state = advance(aerosonde(), flat, state, controls, still_air, 0, step_s).value();
    ASSERT_NEAR(state.ecef_from_body.quaternion.norm(), 1, 3e-16);
  }
}

TEST(FixedWing, AFlightConvergesWithTheFourthOrder) {
  // A rolling pull-up for half a second against steps of 1/6400 s; forces follow the state within a step, or the ratio
  // would be 2. Positions round at 1e-9 m; velocities and attitude do not.
  Controls controls = cruise().controls;
  controls.surfaces.elevator_rad -= 0.1;
  controls.surfaces.aileron_rad += 0.1;
  const auto end = [&](double dt) {
    return BodyVector(to_vector(fly(cruising(), flat, controls, still_air, 0.5, dt))).tail<10>().eval();
  };
  const auto exact = end(1.0 / 6400);
  const double coarse = (end(1.0 / 100) - exact).norm(), fine = (end(1.0 / 200) - exact).norm(),
               finer = (end(1.0 / 400) - exact).norm();
  // The next term of the error is about dt over the servos' lag of 0.02 s: half of it at the coarsest step.
  EXPECT_NEAR(coarse / fine, 16, 8);
  EXPECT_NEAR(fine / finer, 16, 4);
  EXPECT_GT(finer, 1e-10) << "rounding would hide the order";
}

TEST(FixedWing, TheSameFlightGivesTheSameBits) {
  const Environment environment = Environment::wgs84();
  const auto end = [&] { return to_vector(fly(cruising(), environment, cruise().controls, Vector3d(1, 2, 3), 10)); };
  const BodyVector a = end(), b = end();
  EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(double) * 13), 0);
}

TEST(FixedWing, ADivergingFlightIsAnErrorWithItsTime) {
  FixedWingState state = cruising();
  state.body_rates_radps = {1e200, 1e200, 1e200};
  const auto next = advance(aerosonde(), flat, state, cruise().controls, still_air, 3.5, 0.5);
  ASSERT_FALSE(next);
  EXPECT_NE(next.error().message.find("t = 4 s"), std::string::npos) << next.error().message;
}

TEST(FixedWing, StateAndVectorAreTheSameNumbers) {
  BodyVector x;
  for (int i = 0; i < 13; ++i) x[i] = i + 1;
  EXPECT_EQ(to_vector(body_state_from_vector(x)), x);
}

}  // namespace
}  // namespace nadir::sim

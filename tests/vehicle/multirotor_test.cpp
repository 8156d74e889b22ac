#include "nadir/sim/multirotor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "nadir/sim/integrator.h"
#include "nadir/sim/multirotor_motion.h"
#include "nadir/sim/multirotor_trim.h"
#include "vehicle/models.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;

constexpr double density = 1.225, gravity = 9.81, pi = std::numbers::pi;
const Geodetic origin = Geodetic::degrees(38.1, -0.76, 0);
const Environment flat = Environment::flat(origin, gravity, density);

/// Level over the origin, nose north, rotors settled.
MultirotorState level(const Multirotor& vehicle, const MultirotorControls& controls, double charge_ah = 0) {
  MultirotorState state;
  state.position = geodesy::ecef_from_geodetic(origin);
  state.ecef_from_body.quaternion = Eigen::Quaterniond(flat.at(state.position).ecef_from_ned);
  state.charge_ah = charge_ah;
  settle(vehicle, flat, controls, AirMotion{}, state);
  return state;
}

MultirotorControls all(double throttle) { return {RotorValues::Constant(4, throttle)}; }

Multirotor with_motors(double inertia_kgm2, double inductance_h) {
  Multirotor vehicle = quadrotor();
  for (Rotor& rotor : vehicle.rotors) std::get<ElectricDrive>(rotor.drive).dynamics = {inertia_kgm2, inductance_h};
  return vehicle;
}

TEST(Multirotor, TheSetsHaveNoFaults) {
  for (const Multirotor& vehicle : {quadrotor(), pulsed_quadrotor(), lumped_multirotor(), with_motors(2e-4, 8e-6)})
    EXPECT_TRUE(faults_of(vehicle).empty()) << to_string(faults_of(vehicle));
}

TEST(Multirotor, DragIsThatOfTheBodyAndOfTheRotors) {
  const Multirotor vehicle = quadrotor();
  const MultirotorControls controls = all(0.48);
  MultirotorState state = level(vehicle, controls);
  const Vector3d at_rest = output(vehicle, flat, state, controls, AirMotion{}).loads.force_body_n;
  // 8 m/s from the front: half rho CD A V^2, and 0.05 of the thrust for each metre a second
  const Vector3d headwind(-8, 0, 0);
  const MultirotorOutput out = output(vehicle, flat, state, controls, AirMotion(headwind));
  EXPECT_NEAR(out.loads.force_body_n.x(), -(0.5 * density * 2.05 * 0.04 * 64 + 0.05 * out.thrust_n.sum() * 8), 1e-9);
  EXPECT_NEAR(out.loads.force_body_n.z(), at_rest.z(), 1e-9);
}

TEST(Multirotor, WindActsInItsOwnFrame) {
  // Nose to the east, wind towards the north: the air comes from the right, and pushes to the left.
  const Multirotor vehicle = quadrotor();
  const MultirotorControls controls = all(0.48);
  MultirotorState state = level(vehicle, controls);
  state.ecef_from_body.quaternion = state.ecef_from_body.quaternion * geodesy::quaternion_from({pi / 2, 0, 0});
  const Vector3d force = output(vehicle, flat, state, controls, AirMotion(Vector3d(5, 0, 0))).loads.force_body_n;
  EXPECT_LT(force.y(), -1);
  EXPECT_NEAR(force.x(), 0, 1e-9);
}

TEST(Multirotor, RotorsGiveLessInAClimbAndNoMoreInADescent) {
  const Multirotor vehicle = quadrotor();
  const MultirotorControls controls = all(0.48);
  const MultirotorState state = level(vehicle, controls);
  const auto thrust = [&](double climb_mps) {
    return output(vehicle, flat, state, controls, AirMotion(Vector3d(0, 0, climb_mps))).thrust_n.sum();
  };
  EXPECT_LT(thrust(5), thrust(0) - 1);
  EXPECT_EQ(thrust(-5), thrust(0));
}

TEST(Multirotor, GroundEffectIsCheesemanAndBennettsPerRotor) {
  const Multirotor vehicle = quadrotor();
  const MultirotorControls controls = all(0.4);
  MultirotorState state = level(vehicle, controls);
  const double radius = 0.381 / 2;
  const auto lift = [&](double height_m) {
    return -output(vehicle, flat, state, controls, AirMotion{}, height_m).loads.force_body_n.z();
  };
  const double far = lift(1e9);
  for (const double ratio : {0.5, 1.0, 2.0, 4.0})
    EXPECT_NEAR(lift(ratio * radius) / far, 1 / (1 - 1 / (16 * ratio * ratio)), 1e-9);
  EXPECT_EQ(lift(0), lift(radius / 2)) << "where the law ends it goes on as there";
  for (double h = 0; h < 3; h += 0.01) EXPECT_LE(lift(h + 0.01), lift(h)) << "less with height, everywhere";
  // Rolled to the right, the right rotors are lower and lift more: it rights itself
  state.ecef_from_body.quaternion = state.ecef_from_body.quaternion * geodesy::quaternion_from({0, 0, 0.3});
  EXPECT_LT(output(vehicle, flat, state, controls, AirMotion{}, 0.3).loads.moment_body_nm.x(), -0.01);
  // Wind takes the cushion away
  state = level(vehicle, controls);
  EXPECT_GT(lift(0.2),
            -output(vehicle, flat, state, controls, AirMotion(Vector3d(10, 0, 0)), 0.2).loads.force_body_n.z());
}

TEST(Multirotor, YawFollowsFromRotorsThatTurnAgainstTheClock) {
  // Front right and rear left turn against the clock seen from above: with more of them the nose goes right.
  const Multirotor vehicle = quadrotor();
  MultirotorControls controls = all(0.45);
  controls.actuators[0] = controls.actuators[2] = 0.5;
  const MultirotorState state = level(vehicle, controls);
  const Loads loads = output(vehicle, flat, state, controls, AirMotion{}).loads;
  EXPECT_GT(loads.moment_body_nm.z(), 0.01);
  EXPECT_NEAR(loads.moment_body_nm.head<2>().norm(), 0, 1e-12);
}

/// Without air the angular momentum of body and rotors together stays what it is, in size and
/// direction, while motors run up and the body tumbles.
TEST(Multirotor, AngularMomentumOfBodyAndRotorsIsKept) {
  const double inertia = 2e-4;
  Multirotor vehicle = with_motors(inertia, 0);
  vehicle.drag = {};
  vehicle.rotors[1].clockwise = false;  // so that there is momentum to exchange
  const Environment vacuum = Environment::flat(origin, gravity, 1e-12);
  const auto momentum = [&](const MultirotorState& state) {
    Vector3d body = vehicle.mass.inertia_kgm2() * state.body_rates_radps;
    for (Eigen::Index i = 0; i < 4; ++i) {
      const Rotor& rotor = vehicle.rotors[static_cast<std::size_t>(i)];
      body += (rotor.clockwise ? -1 : 1) * inertia * state.omega_radps[i] * rotor.thrust_axis;
    }
    return Vector3d(state.ecef_from_body.quaternion * body);
  };
  MultirotorState state = level(vehicle, all(0));
  state.body_rates_radps = {0.5, -0.3, 0.2};
  state.omega_radps = RotorValues::Constant(4, 100);
  const Vector3d before = momentum(state);
  MultirotorControls controls = all(0.5);
  controls.actuators[2] = 0.8;
  for (int i = 0; i < 400; ++i)
    state = advance(vehicle, vacuum, state, controls, AirMotion{}, i / 400.0, 1.0 / 400).value();
  EXPECT_GT((state.omega_radps - 100).abs().minCoeff(), 100) << "motors ran up";
  EXPECT_NEAR((momentum(state) - before).norm(), 0, 1e-6 * before.norm());
}

TEST(Multirotor, AFlightConvergesWithTheFourthOrder) {
  for (const Multirotor& vehicle : {quadrotor(), pulsed_quadrotor(), with_motors(2e-4, 0)}) {
    MultirotorControls controls = all(0.5);
    controls.actuators[0] = 0.52;
    const MultirotorState start = level(vehicle, all(0.5));
    const auto flown = [&](int steps) {
      MultirotorState state = start;
      for (int i = 0; i < steps; ++i)
        state =
            advance(vehicle, flat, state, controls, AirMotion(Vector3d(3, 1, 0)), i * 0.4 / steps, 0.4 / steps).value();
      return state;
    };
    const MultirotorState fine = flown(3200);
    const auto error = [&](int steps) { return (flown(steps).velocity.xyz - fine.velocity.xyz).norm(); };
    EXPECT_NEAR(error(80) / error(160), 16, 5);
  }
}

TEST(Multirotor, LagsAreExactAtAnyStep) {
  for (const Multirotor& vehicle : {pulsed_quadrotor(), lumped_multirotor()}) {
    MultirotorState once = level(vehicle, all(0.3)), often = once;
    follow_for(vehicle, all(0.7), 0.3, once);
    for (int i = 0; i < 300; ++i) follow_for(vehicle, all(0.7), 0.001, often);
    EXPECT_NEAR((once.followed - often.followed).abs().maxCoeff(), 0, 1e-9);
  }
}

TEST(Multirotor, ABatterySagsUnderAllMotorsAndRunsEmpty) {
  Multirotor vehicle = quadrotor();
  vehicle.battery = lithium_polymer(6, 0.05, 0.03);
  vehicle.battery->other_current_a = 0.5;
  const double full_ah = 0.05;
  MultirotorState state = level(vehicle, all(0.5), full_ah);
  const MultirotorOutput one = [&] {
    MultirotorControls controls = all(0);
    controls.actuators[0] = 0.5;
    return output(vehicle, flat, state, controls, AirMotion{});
  }();
  const MultirotorOutput four = output(vehicle, flat, state, all(0.5), AirMotion{});
  EXPECT_LT(four.thrust_n[0], one.thrust_n[0]) << "the others take voltage";
  EXPECT_NEAR(four.supply_v, 25.2 - 0.03 * four.supply_current_a, 1e-9);
  EXPECT_NEAR(four.supply_current_a, 0.5 + 0.5 * four.current_a.sum(), 1e-9);

  // It lasts its capacity over its current, which falls with the voltage; then it falls, and nothing is not a number
  double empty_s = -1;
  for (int i = 0; i < 25 * 400; ++i) {
    state = advance(vehicle, flat, state, all(0.5), AirMotion{}, i / 400.0, 1.0 / 400).value();
    if (state.charge_ah == 0 && empty_s < 0) empty_s = i / 400.0;
  }
  const double at_first_s = 3600 * full_ah / four.supply_current_a;
  EXPECT_GT(empty_s, at_first_s);
  EXPECT_LT(empty_s, 1.3 * at_first_s);
  EXPECT_EQ(output(vehicle, flat, state, all(0.5), AirMotion{}).thrust_n.sum(), 0);
}

TEST(Multirotor, MotorsWithInertiaAndBatteryComeToTheSameHover) {
  Multirotor at_once = quadrotor(), slow = with_motors(2e-4, 2e-4 * 0.042);
  at_once.battery = slow.battery = lithium_polymer(6, 5, 0.03);
  const MultirotorControls controls = all(0.47);
  MultirotorState state = level(slow, all(0.3), 5);
  MultirotorOutput out;
  for (int i = 0; i < 400; ++i) {
    state = advance(slow, flat, state, controls, AirMotion{}, i / 400.0, 1.0 / 400).value();
    state.velocity.xyz.setZero();  // held in place
  }
  const MultirotorOutput expected =
      output(at_once, flat, level(at_once, controls, state.charge_ah), controls, AirMotion{});
  EXPECT_NEAR(state.omega_radps[0], expected.omega_radps[0], 1e-3);
  EXPECT_NEAR(state.current_a[0], expected.current_a[0], 1e-2);
}

/// The whole vehicle by a stiff method with its currents, asked at 100 Hz, against Runge-Kutta steps of 2.5 ms with
/// currents settled.
TEST(Multirotor, CurrentsIntegratedOrSettledGiveTheSameFlight) {
  const Multirotor vehicle = with_motors(2e-4, 2e-4 * 0.042);
  MultirotorControls controls = all(0.5);
  controls.actuators[0] = 0.53;
  const MultirotorState start = level(vehicle, all(0.48));
  const AirOverTime still;
  MultirotorState settled = start;
  for (int i = 0; i < 40; ++i) settled = advance(vehicle, flat, settled, controls, still, i / 400.0, 1.0 / 400).value();

  const MultirotorMotion motion(vehicle, flat, start, controls, still, 0, CurrentModel::Integrated);
  MultirotorVector x = to_vector(vehicle, start, CurrentModel::Integrated);
  ASSERT_EQ(x.size(), 13 + 8);
  auto tolerance = Tolerance<MultirotorVector>::same(x, 1e-7, 0);
  tolerance.absolute.tail(8).setConstant(1e-4);
  Integrator<MultirotorVector> stiff({Scheme::Method::Rosenbrock}, x, tolerance);
  for (int i = 0; i < 10; ++i) {
    const auto done = stiff.advance(motion, 0.01 * i, 0.01 * (i + 1), x);
    ASSERT_TRUE(done) << done.error().message;
  }
  const MultirotorState integrated = motion.state_at(0.1, x);
  // After the jump the settled current runs 0.2 ms ahead: of a roll that grows by 13 rad/s^2, and a lift of 2 m/s^2
  EXPECT_NEAR((settled.body_rates_radps - integrated.body_rates_radps).norm(), 0, 2e-4 * 20);
  EXPECT_NEAR((settled.velocity.xyz - integrated.velocity.xyz).norm(), 0, 2e-4 * 6);
  EXPECT_NEAR(settled.omega_radps[0], integrated.omega_radps[0], 0.1);
  EXPECT_GT(integrated.body_rates_radps.norm(), 0.1);
}

TEST(Multirotor, AFailedRotorTumblesItAndStaysFinite) {
  for (const Multirotor& vehicle : {quadrotor(), with_motors(2e-4, 0)}) {
    MultirotorControls controls = all(0.48);
    controls.actuators[0] = 0;
    MultirotorState state = level(vehicle, all(0.48));
    for (int i = 0; i < 10 * 400; ++i) {
      const auto next = advance(vehicle, flat, state, controls, AirMotion{}, i / 400.0, 1.0 / 400);
      ASSERT_TRUE(next) << next.error().message;
      state = *next;
    }
    EXPECT_TRUE(to_vector(state).allFinite());
    EXPECT_GT(state.body_rates_radps.norm(), 1);
  }
}

TEST(Multirotor, EveryFaultIsNamed) {
  Multirotor vehicle = with_motors(2e-4, 1);
  vehicle.rotors[1].thrust_axis *= 2;
  vehicle.rotors[2].rise_time_constant_s = -1;
  vehicle.rotors[3].drive = PulseDrive{};
  vehicle.drag.linear_nspm = -0.1;
  vehicle.battery = Battery{};
  std::string all_of_them;
  for (const ParameterFault& fault : faults_of(vehicle)) all_of_them += fault.key + ": " + fault.message + "\n";
  for (const char* part : {"rotors.front right: drive: inductance_h: an electrical time constant",
                           "rotors.rear right: thrust_axis: expected a length of 1",
                           "rotors.rear left: rise_time_constant_s: expected a time constant",
                           "rotors.front left: drive: max_thrust_n: expected a greatest thrust",
                           "rotors.front left: it is not driven like rotor front right",
                           "drag: linear_nspm: ", "battery: capacity_ah: expected a capacity"})
    EXPECT_NE(all_of_them.find(part), std::string::npos) << part << "\n" << all_of_them;
  EXPECT_FALSE(faults_of(Multirotor{}).empty());
}

}  // namespace
}  // namespace nadir::sim

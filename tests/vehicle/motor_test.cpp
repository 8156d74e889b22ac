#include <gtest/gtest.h>

#include <cmath>

#include "nadir/sim/integrator.h"
#include "nadir/sim/multirotor.h"
#include "vehicle/models.h"

namespace nadir::sim {
namespace {

using Vector2 = Eigen::Vector2d;
constexpr double density = 1.225;

ElectricDrive motor(double inertia_kgm2, double inductance_h) {
  ElectricDrive drive = std::get<ElectricDrive>(quadrotor().rotors[0].drive);
  drive.dynamics = {inertia_kgm2, inductance_h};
  return drive;
}

/// Speed and current of a motor at rest in the air.
struct Winding {
  ElectricDrive drive;
  double throttle;
  static constexpr bool autonomous = true;
  Vector2 operator()(double, const Vector2& x) const {
    const auto& [m, dynamics] = drive;
    const double torque = propeller_at(m, x[0], 0, density).torque_nm;
    return {spin_change(m, dynamics, x[0], x[1], torque),
            current_change(m, dynamics, throttle * m.max_voltage_v, x[0], x[1])};
  }
};

/// The same with the current settled.
struct Slow {
  ElectricDrive drive;
  double throttle;
  double operator()(double omega) const {
    const auto& [m, dynamics] = drive;
    const double torque = propeller_at(m, omega, 0, density).torque_nm;
    return settled_spin_change(m, dynamics, throttle * m.max_voltage_v, omega, torque);
  }
};

double speed_after(const Slow& slow, double omega, double seconds, int steps) {
  const auto f = [&](double, const Eigen::Matrix<double, 1, 1>& x) { return Eigen::Matrix<double, 1, 1>(slow(x[0])); };
  Eigen::Matrix<double, 1, 1> x(omega);
  for (int i = 0; i < steps; ++i) x = rk4_step(f, 0, x, seconds / steps);
  return x[0];
}

TEST(Motor, ComesToTheSpeedOfTheBalance) {
  for (const double throttle : {0.1, 0.5, 1.0}) {
    const Slow slow{motor(2e-4, 0), throttle};
    const double balance = propel(slow.drive.propulsion, throttle, 0, density).omega_radps;
    EXPECT_NEAR(speed_after(slow, 0, 2, 2000), balance, 1e-6 * balance);
    EXPECT_NEAR(throttle_at(slow.drive.propulsion, balance, 0, density), throttle, 1e-12);
  }
}

TEST(Motor, ATenthOfAPercentOfSpeedDecaysWithTheMechanicalTimeConstant) {
  const Slow slow{motor(2e-4, 0), 0.5};
  const double balance = propel(slow.drive.propulsion, 0.5, 0, density).omega_radps;
  const double tau = mechanical_time_constant_s(slow.drive.propulsion, slow.drive.dynamics, balance, density);
  // The torque's curvature changes the rate by 1e-4 of itself over 1e-3 of the speed
  EXPECT_NEAR((speed_after(slow, 1.001 * balance, tau, 100) - balance) / (0.001 * balance), std::exp(-1.0), 2e-4);
}

TEST(Motor, FrictionStopsItAndTurnsNothingBackwards) {
  const Slow slow{motor(2e-4, 0), 0};
  EXPECT_EQ(slow(0), 0);
  EXPECT_LT(slow(1), 0);
}

/// A winding of 0.2 ms on a motor of about 10 ms, asked at 100 Hz: by a stiff method, and with the current settled.
TEST(Motor, AnElectricalTimeConstantOfAFifthOfAMillisecond) {
  const double inductance = 2e-4 * 0.042;
  const Winding winding{motor(2e-4, inductance), 0.6};
  const Propulsion& m = winding.drive.propulsion;
  EXPECT_NEAR(electrical_time_constant_s(m, winding.drive.dynamics), 2e-4, 1e-12);
  const double start = propel(m, 0.4, 0, density).omega_radps;
  const Vector2 at_rest(start, settled_current_a(m, 0.4 * m.max_voltage_v, start));

  const auto flown = [&](double relative, int intervals) {
    const auto tolerance = Tolerance<Vector2>::same(at_rest, 1e-3 * relative, relative);
    Integrator<Vector2> stiff({Scheme::Method::Rosenbrock}, at_rest, tolerance);
    Vector2 x = at_rest;
    for (int i = 0; i < intervals; ++i) EXPECT_TRUE(stiff.advance(winding, 0.01 * i, 0.01 * (i + 1), x));
    return std::pair(x, stiff.work());
  };
  const auto [exact, exact_work] = flown(1e-10, 3);
  const auto [stiff, stiff_work] = flown(1e-4, 3);
  EXPECT_NEAR(stiff[0], exact[0], 1e-3 * exact[0]);
  EXPECT_LT(stiff_work.steps, 60);
  RecordProperty("rosenbrock_steps", static_cast<int>(stiff_work.steps));
  RecordProperty("rosenbrock_evaluations", static_cast<int>(stiff_work.evaluations));

  // Settled: one step of 2.5 ms a quarter of an interval. It runs ahead by the electrical time constant after a jump,
  // and by no more than that.
  const Slow slow{winding.drive, 0.6};
  const double settled = speed_after(slow, start, 0.03, 12);
  const double rate = slow(settled);
  EXPECT_NEAR(settled, exact[0], 1.5 * 2e-4 * std::abs(rate) + 1e-4 * exact[0]);
  // In a slow change it is much better than a current without inductance: first order of it is in
  const Slow without{motor(2e-4, 0), 0.6};
  EXPECT_NE(slow(start), without(start));
}

/// Near the slow manifold the settled current's rate is right to second order: halving the inductance quarters its
/// error.
TEST(Motor, TheErrorOfASettledCurrentIsOfSecondOrderInItsTimeConstant) {
  const auto error = [](double tau_s) {
    const Winding winding{motor(2e-3, tau_s * 0.042), 0.6};
    const Propulsion& m = winding.drive.propulsion;
    const double start = propel(m, 0.4, 0, density).omega_radps;
    Vector2 x(start, settled_current_a(m, 0.6 * m.max_voltage_v, start));
    Integrator<Vector2> stiff({Scheme::Method::Rosenbrock}, x, Tolerance<Vector2>::same(x, 1e-11, 1e-11));
    EXPECT_TRUE(stiff.advance(winding, 0, 20 * tau_s, x));  // the winding has settled
    return std::abs(Slow{winding.drive, 0.6}(x[0]) / winding(0, x)[0] - 1);
  };
  EXPECT_NEAR(error(4e-4) / error(2e-4), 4, 0.5);
}

TEST(Battery, VoltageFallsWithChargeAndIsNoneWithoutIt) {
  const Battery battery = lithium_polymer(6, 5, 0.02);
  EXPECT_TRUE(faults_of(battery).empty());
  EXPECT_NEAR(open_circuit_v(battery, 5), 25.2, 1e-12);
  EXPECT_NEAR(open_circuit_v(battery, 6), 25.2, 1e-12);
  EXPECT_NEAR(open_circuit_v(battery, 2.5), 6 * 3.84, 1e-12);
  EXPECT_NEAR(open_circuit_v(battery, 1e-12), 6 * 3.27, 1e-9);
  EXPECT_EQ(open_circuit_v(battery, 0), 0);
  for (double share = 0.01; share < 1; share += 0.01)
    EXPECT_GT(open_circuit_v(battery, 5 * (share + 0.01)), open_circuit_v(battery, 5 * share));
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/sim/propulsion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {
constexpr double turns_per_rad = std::numbers::inv_pi / 2;
}

PropulsionOutput propel(const Propulsion& propulsion, double throttle, double airspeed_mps, double density_kgpm3) {
  const Propulsion& m = propulsion;
  const double d = m.diameter_m, d2 = d * d, d3 = d2 * d, d4 = d2 * d2;

  // Torque of the propeller less that of the motor is a quadratic of the rate; its upper root is the stable one.
  const double stalled_nmpv = m.kq_vspr / m.resistance_ohm;  // the motor's torque per volt
  const double a = m.cq0 * density_kgpm3 * d4 * d * (turns_per_rad * turns_per_rad);
  const double b = m.cq1 * density_kgpm3 * d4 * airspeed_mps * turns_per_rad + m.kq_vspr * stalled_nmpv;
  const double c = m.cq2 * density_kgpm3 * d3 * airspeed_mps * airspeed_mps -
                   stalled_nmpv * m.max_voltage_v * throttle + m.kq_vspr * m.no_load_current_a;
  const double root = std::sqrt(std::max(0.0, b * b - 4 * a * c));
  const double omega = std::max(0.0, (root - b) / (2 * a));
  return propeller_at(propulsion, omega, airspeed_mps, density_kgpm3);
}

PropulsionOutput propeller_at(const Propulsion& m, double omega_radps, double airspeed_mps, double density_kgpm3) {
  // Written in revolutions and airspeed rather than in the advance ratio, which is infinite at rest.
  const double d = m.diameter_m, d2 = d * d, d3 = d2 * d;
  const double n = omega_radps * turns_per_rad, va = airspeed_mps;
  PropulsionOutput out;
  out.omega_radps = omega_radps;
  out.thrust_n = density_kgpm3 * d2 * (m.ct0 * d2 * n * n + m.ct1 * d * va * n + m.ct2 * va * va);
  out.torque_nm = density_kgpm3 * d3 * (m.cq0 * d2 * n * n + m.cq1 * d * va * n + m.cq2 * va * va);
  return out;
}

double settled_current_a(const Propulsion& m, double voltage_v, double omega_radps) {
  return (voltage_v - m.kq_vspr * omega_radps) / m.resistance_ohm;
}

double throttle_at(const Propulsion& m, double omega_radps, double airspeed_mps, double density_kgpm3) {
  const double torque_nm = propeller_at(m, omega_radps, airspeed_mps, density_kgpm3).torque_nm;
  const double current_a = torque_nm / m.kq_vspr + m.no_load_current_a;
  return (m.kq_vspr * omega_radps + m.resistance_ohm * current_a) / m.max_voltage_v;
}

double electrical_time_constant_s(const Propulsion& m, const MotorDynamics& dynamics) {
  return dynamics.inductance_h / m.resistance_ohm;
}

double mechanical_time_constant_s(const Propulsion& m, const MotorDynamics& dynamics, double omega_radps,
                                  double density_kgpm3) {
  const double d = m.diameter_m, d5 = d * d * d * d * d;
  const double propeller =
      2 * m.cq0 * density_kgpm3 * d5 * (turns_per_rad * turns_per_rad) * omega_radps;  // slope of its torque
  return dynamics.rotor_inertia_kgm2 / (m.kq_vspr * m.kq_vspr / m.resistance_ohm + propeller);
}

namespace {
double accelerated(double omega_radps, double torque_nm, double inertia_kgm2) {
  if (omega_radps <= 0 && torque_nm < 0) return 0;
  return torque_nm / inertia_kgm2;
}
}  // namespace

double spin_change(const Propulsion& m, const MotorDynamics& dynamics, double omega_radps, double current_a,
                   double torque_nm) {
  return accelerated(omega_radps, m.kq_vspr * (current_a - m.no_load_current_a) - torque_nm,
                     dynamics.rotor_inertia_kgm2);
}

double current_change(const Propulsion& m, const MotorDynamics& dynamics, double voltage_v, double omega_radps,
                      double current_a) {
  return (voltage_v - m.resistance_ohm * current_a - m.kq_vspr * omega_radps) / dynamics.inductance_h;
}

double settled_spin_change(const Propulsion& m, const MotorDynamics& dynamics, double voltage_v, double omega_radps,
                           double torque_nm) {
  const double current_a = settled_current_a(m, voltage_v, omega_radps);
  const double lag_s = electrical_time_constant_s(m, dynamics);
  const double inertia = dynamics.rotor_inertia_kgm2 - lag_s * m.kq_vspr * m.kq_vspr / m.resistance_ohm;
  return accelerated(omega_radps, m.kq_vspr * (current_a - m.no_load_current_a) - torque_nm, inertia);
}

}  // namespace nadir::sim

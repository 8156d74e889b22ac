#include "nadir/sim/rotor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double least_pulse_us = 1000, pulse_range_us = 1000;

double quadratic(const std::array<double, 3>& c, double x) { return (c[0] * x + c[1]) * x + c[2]; }

/// The greater solution of c2 x^2 + c1 x + c0 = y, or the vertex where there is none.
double upper_root(double c2, double c1, double c0, double y) {
  if (c2 == 0) return (y - c0) / c1;
  return (-c1 + std::sqrt(std::max(0.0, c1 * c1 - 4 * c2 * (c0 - y)))) / (2 * c2);
}

}  // namespace

double radius_m(const Rotor& rotor) {
  if (const auto* electric = std::get_if<ElectricDrive>(&rotor.drive)) return electric->propulsion.diameter_m / 2;
  return std::get<PulseDrive>(rotor.drive).radius_m;
}

RotorOutput pulse_output(const PulseDrive& drive, double throttle) {
  const double pulse_us = least_pulse_us + pulse_range_us * std::clamp(throttle, 0.0, 1.0);
  RotorOutput out;
  out.thrust_n = std::clamp(quadratic(drive.thrust_n, pulse_us), 0.0, drive.max_thrust_n);
  out.torque_nm = std::max(0.0, quadratic(drive.torque_nm, pulse_us));
  return out;
}

RotorOutput propeller_output(const Propulsion& propulsion, double omega_radps, double axial_mps, double density_kgpm3) {
  constexpr double least_coefficient = 1e-4;
  const PropulsionOutput propeller = propeller_at(propulsion, omega_radps, std::max(0.0, axial_mps), density_kgpm3);
  const double n = omega_radps / (2 * pi), d = propulsion.diameter_m, d2 = d * d;
  const double least_n = least_coefficient * density_kgpm3 * n * n * d2 * d2;
  RotorOutput out;
  out.thrust_n = std::max(least_n, propeller.thrust_n);
  out.torque_nm = std::max(least_n * d, propeller.torque_nm);
  out.omega_radps = omega_radps;
  return out;
}

RotorOutput settled_output(const Rotor& rotor, double throttle, double axial_mps, double density_kgpm3,
                           double voltage_v) {
  const auto* electric = std::get_if<ElectricDrive>(&rotor.drive);
  if (!electric) return pulse_output(std::get<PulseDrive>(rotor.drive), throttle);
  const Propulsion& motor = electric->propulsion;
  const double share = voltage_v > 0 ? voltage_v / motor.max_voltage_v : 1;
  const double driven = std::clamp(throttle, 0.0, 1.0) * share;
  const double omega = propel(motor, driven, std::max(0.0, axial_mps), density_kgpm3).omega_radps;
  RotorOutput out = propeller_output(motor, omega, axial_mps, density_kgpm3);
  out.current_a = settled_current_a(motor, driven * motor.max_voltage_v, omega);
  return out;
}

double throttle_for_thrust(const Rotor& rotor, double thrust_n, double axial_mps, double density_kgpm3,
                           double voltage_v) {
  const double thrust = std::max(0.0, thrust_n);
  const auto* electric = std::get_if<ElectricDrive>(&rotor.drive);
  if (!electric) {
    const auto& c = std::get<PulseDrive>(rotor.drive).thrust_n;
    return std::max(0.0, (upper_root(c[0], c[1], c[2], thrust) - least_pulse_us) / pulse_range_us);
  }
  const Propulsion& motor = electric->propulsion;
  const double d = motor.diameter_m, d2 = d * d, axial = std::max(0.0, axial_mps);
  const double n =
      std::max(0.0, upper_root(density_kgpm3 * d2 * d2 * motor.ct0, density_kgpm3 * d2 * d * motor.ct1 * axial,
                               density_kgpm3 * d2 * motor.ct2 * axial * axial, thrust));
  const double throttle = throttle_at(motor, 2 * pi * n, axial, density_kgpm3);
  return std::max(0.0, voltage_v > 0 ? throttle * motor.max_voltage_v / voltage_v : throttle);
}

}  // namespace nadir::sim

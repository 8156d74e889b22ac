#include "nadir/sim/propulsion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nadir::sim {

PropulsionOutput propel(const Propulsion& propulsion, double throttle, double airspeed_mps, double density_kgpm3) {
  constexpr double pi = std::numbers::pi;
  const Propulsion& m = propulsion;
  const double d = m.diameter_m, d2 = d * d, d3 = d2 * d, d4 = d2 * d2;

  // Torque of the propeller less that of the motor is a quadratic of the rate; its upper root is the stable one.
  const double a = m.cq0 * density_kgpm3 * d4 * d / (4 * pi * pi);
  const double b = m.cq1 * density_kgpm3 * d4 * airspeed_mps / (2 * pi) + m.kq_vspr * m.kq_vspr / m.resistance_ohm;
  const double c = m.cq2 * density_kgpm3 * d3 * airspeed_mps * airspeed_mps -
                   m.kq_vspr / m.resistance_ohm * m.max_voltage_v * throttle + m.kq_vspr * m.no_load_current_a;
  const double root = std::sqrt(std::max(0.0, b * b - 4 * a * c));
  const double omega = std::max(0.0, (root - b) / (2 * a));

  // Written in revolutions and airspeed rather than in the advance ratio, which is infinite at rest.
  const double n = omega / (2 * pi), va = airspeed_mps;
  PropulsionOutput out;
  out.omega_radps = omega;
  out.thrust_n = density_kgpm3 * d2 * (m.ct0 * d2 * n * n + m.ct1 * d * va * n + m.ct2 * va * va);
  out.torque_nm = density_kgpm3 * d3 * (m.cq0 * d2 * n * n + m.cq1 * d * va * n + m.cq2 * va * va);
  return out;
}

}  // namespace nadir::sim

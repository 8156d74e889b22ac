#include "nadir/sim/slipstream.h"

#include <cmath>

namespace nadir::sim {

PropulsionOutput propel(const Slipstream& slipstream, double throttle, double airspeed_mps, double density_kgpm3) {
  const double square = throttle * std::abs(throttle), full = slipstream.full_speed_mps;
  const double pressure_n = 0.5 * density_kgpm3 * slipstream.area_m2 * slipstream.coefficient;
  return {.omega_radps = 0,
          .thrust_n = pressure_n * (full * full * square - airspeed_mps * airspeed_mps),
          .torque_nm = slipstream.full_torque_nm * square};
}

PropulsionOutput propel(const FixedWingPropulsion& propulsion, double throttle, double airspeed_mps,
                        double density_kgpm3) {
  if (const auto* electric = std::get_if<Propulsion>(&propulsion))
    return propel(*electric, throttle, airspeed_mps, density_kgpm3);
  return propel(std::get<Slipstream>(propulsion), throttle, airspeed_mps, density_kgpm3);
}

}  // namespace nadir::sim

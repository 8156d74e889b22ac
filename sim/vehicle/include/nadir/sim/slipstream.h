#pragma once

#include <variant>

#include "nadir/sim/propulsion.h"

namespace nadir::sim {

/// A propeller by momentum alone: throttle sets the speed of its slipstream, whatever turns it.
/// Source: Beard and McLain, Small Unmanned Aircraft, 2012, section 4.3.
struct Slipstream {
  double area_m2 = 0;         // swept
  double coefficient = 0;     // of thrust, about 1
  double full_speed_mps = 0;  // of the slipstream at full throttle
  double full_torque_nm = 0;  // on the propeller at full throttle; goes with the square of it
};

/// Thrust is rho S C (v^2 - Va^2) / 2 for a slipstream at v. It has no rate. Throttles below zero, which a solver may
/// ask for, suck as positive ones blow, so that thrust rises with throttle everywhere.
PropulsionOutput propel(const Slipstream& slipstream, double throttle, double airspeed_mps, double density_kgpm3);

/// What drives a fixed wing.
using FixedWingPropulsion = std::variant<Propulsion, Slipstream>;
PropulsionOutput propel(const FixedWingPropulsion& propulsion, double throttle, double airspeed_mps,
                        double density_kgpm3);

}  // namespace nadir::sim

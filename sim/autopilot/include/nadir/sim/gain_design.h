#pragma once

#include "nadir/sim/autopilot.h"

namespace nadir::sim {

/// How often an autopilot acts on what it sees, unless told.
inline constexpr double control_period_s = 0.01;

/// All gains between a path and the controls.
struct FlightGains {
  AutopilotGains autopilot;
  PathGains path;
};

/// From the derivatives of a vehicle in level trim, loop by loop, each placed in closed form and slower than the one
/// within it; sim/autopilot's README has the formulas and shows the responses.
FlightGains designed_gains(const FixedWing& vehicle, const Trim& level, double density_kgpm3, double gravity_mps2);

}  // namespace nadir::sim

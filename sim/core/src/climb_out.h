#pragma once

#include "nadir/render/surface.h"
#include "nadir/sim/flown_fixed_wing.h"
#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// Where a take-off from `begin` ends, in the run's winds without gusts and turbulence: its mission begins there.
Result<Waypoint> climb_out(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                           const Waypoint& begin, const FixedWingGroundSetup& ground_setup,
                           const render::Surface& ground);

}  // namespace nadir::sim

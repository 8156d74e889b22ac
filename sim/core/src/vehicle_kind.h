#pragma once

#include "nadir/sim/plan_check.h"
#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// What planning has to know of a vehicle that is flown: the only part of it that asks for its kind.
FlightLimits flight_limits(const VehicleSetup& setup);

/// Pitch of straight and level flight at an airspeed. Fails where there is none.
Result<double> level_pitch_rad(const RunFile& run, const VehicleSetup& setup, double airspeed_mps,
                               const geodesy::Point<geodesy::frame::Ecef>& place);

}  // namespace nadir::sim

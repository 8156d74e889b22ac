#pragma once

#include "nadir/render/surface.h"
#include "nadir/sim/multirotor_trim.h"
#include "nadir/sim/plan_check.h"
#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// What planning has to know of a fixed wing.
FlightLimits flight_limits(const VehicleSetup& setup);

/// What planning has to know of a multirotor in the air of a place: the airspeed that it reaches leaning as far as its
/// control lets it, and the rate that it climbs at.
FlightLimits multirotor_limits(const RunFile& run, const VehicleSetup& setup, const render::Surface& ground,
                               const geodesy::Point<geodesy::frame::Ecef>& place);

/// Steady flight of a multirotor through the air, north, east and down, nose towards `yaw_rad`. Fails where it has
/// none, or would lean more than its control lets it.
Result<MultirotorTrim> multirotor_steady(const RunFile& run, const VehicleSetup& setup, double yaw_rad,
                                         const Eigen::Vector3d& through_air_ned_mps, const render::Surface& ground,
                                         const geodesy::Point<geodesy::frame::Ecef>& place);

/// Pitch of straight and level flight at an airspeed. Fails where there is none.
Result<double> level_pitch_rad(const RunFile& run, const VehicleSetup& setup, double airspeed_mps,
                               const geodesy::Point<geodesy::frame::Ecef>& place);

}  // namespace nadir::sim

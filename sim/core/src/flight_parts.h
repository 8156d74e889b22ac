#pragma once

#include <memory>

#include "nadir/render/surface.h"
#include "nadir/sim/plan_flight.h"
#include "nadir/sim/pose_source.h"
#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// Height above the tangent plane at the scene origin of a typed height. `msl` and `ellipsoid` are taken at the origin.
Result<double> height_in_scene_m(const geodesy::TypedHeight& height, const render::Surface& ground);

/// Of a place, along the normal of the ground.
double height_above_ground_m(const render::Surface& ground, const geodesy::Point<geodesy::frame::Ecef>& place);

/// What moves the air around one vehicle. Its turbulence is its own, by its name.
Result<AirParts> make_air(const RunFile& run, const std::string& name, double span_m, const render::Surface& ground);

/// The run's Earth and air at rest, the sea being where it is at a place.
Result<Environment> environment_of(const RunFile& run, const geodesy::LocalFrame& scene,
                                   const geodesy::Geodetic& place);

/// A flight whose motion is stepped as the run file says, else in the cheapest way within its tolerance.
Result<std::unique_ptr<PoseSource>> planned_flight(const MakeFlight& make, const VehicleSetup& setup,
                                                   std::int64_t duration_ns);

}  // namespace nadir::sim

#pragma once

#include <memory>

#include "nadir/render/surface.h"
#include "nadir/sim/plan_motion.h"
#include "nadir/sim/pose_source.h"
#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// The run's Earth and air at rest, the sea being where it is at a place.
Result<Environment> environment_of(const RunFile& run, const geodesy::LocalFrame& scene,
                                   const geodesy::Geodetic& place);

/// A flight whose motion is stepped as the run file says, else in the cheapest way within its tolerance.
Result<std::unique_ptr<PoseSource>> planned_flight(const MakeFlight& make, const VehicleSetup& setup,
                                                   std::int64_t duration_ns);

}  // namespace nadir::sim

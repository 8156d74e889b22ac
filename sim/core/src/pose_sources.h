#pragma once

#include <memory>

#include "nadir/render/plane.h"
#include "nadir/sim/flight_plan.h"
#include "nadir/sim/pose_source.h"
#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// A vehicle flown by its autopilot, from trim, in the run's air.
Result<std::unique_ptr<PoseSource>> make_flight(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                                                const FlightPlan& plan, const render::Surface& ground);

/// A multirotor flown by its autopilot, from hover or from standing on the ground.
Result<std::unique_ptr<PoseSource>> make_multirotor_flight(const RunFile& run, const std::string& name,
                                                           const VehicleSetup& setup, const MultirotorPlan& plan,
                                                           const render::Surface& ground);

/// A vehicle that is where a pose file says; between its rows in a straight line, turning evenly.
Result<std::unique_ptr<PoseSource>> make_recorded_poses(const RunFile& run, const VehicleSetup& setup,
                                                        const render::Surface& ground);

}  // namespace nadir::sim

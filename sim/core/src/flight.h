#pragma once

#include <memory>

#include "nadir/render/plane.h"
#include "nadir/sim/pose_source.h"
#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// A fixed wing flown by its autopilot: dynamics at 400 Hz, control at 100 Hz, from trim,
/// in air sampled at 100 Hz.
Result<std::unique_ptr<PoseSource>> make_flight(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                                                const render::Surface& ground);

/// A vehicle that is where a pose file says; between its rows in a straight line, turning evenly.
Result<std::unique_ptr<PoseSource>> make_recorded_poses(const RunFile& run, const VehicleSetup& setup,
                                                        const render::Surface& ground);

}  // namespace nadir::sim

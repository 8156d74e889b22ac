#pragma once

#include "nadir/render/surface.h"
#include "nadir/sim/air_along_path.h"
#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// The winds of a run that are functions of time and place: all but gusts and turbulence.
Result<std::vector<std::unique_ptr<WindSource>>> make_winds(const RunFile& run);

/// Their sum at the beginning of a run, towards north, east and down.
Result<Eigen::Vector3d> wind_at(const std::vector<std::unique_ptr<WindSource>>& winds,
                                const geodesy::Point<geodesy::frame::Ecef>& place, const render::Surface& ground);

/// What moves the air around one vehicle. Its turbulence is its own, by its name.
Result<AirParts> make_air(const RunFile& run, const std::string& name, double span_m, const render::Surface& ground);

}  // namespace nadir::sim

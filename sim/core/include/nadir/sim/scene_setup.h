#pragma once

#include "nadir/render/scene.h"
#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// How a sensor sees a map: its role, bands and scale, and the output asked for. A change of type needs a range unless
/// both are whole unsigned types.
Result<render::LayerOptions> layer_options(const tile::Map& map, const MapSetup& setup,
                                           std::optional<tile::SampleType> output,
                                           const std::optional<std::pair<double, double>>& range);

/// The ground at a height over the scene origin: the one given, else the middle of `first_map` on the ground.
Result<render::Surface> ground_surface(SurfaceShape shape, const std::optional<OriginSetup>& origin,
                                       const geodesy::TypedHeight& ground, const tile::Map& first_map);

}  // namespace nadir::sim

#pragma once

#include "nadir/render/surface.h"
#include "nadir/sim/mission.h"
#include "nadir/sim/mission_setup.h"

namespace nadir::sim {

/// A place in the tangent plane of the scene's origin.
struct ScenePlace {
  Eigen::Vector2d north_east_m = Eigen::Vector2d::Zero();
  double height_m = 0;
};

/// Over a plane, heights count from the tangent plane, with `msl` and `ellipsoid` taken at the origin; over the curved
/// Earth they hold at the place.
Result<ScenePlace> place_in_scene(const PlaceSetup& place, const geodesy::TypedHeight& height,
                                  const render::Surface& ground);

geodesy::Point<geodesy::frame::Ecef> ecef_from_scene(const ScenePlace& place, const render::Surface& ground);

/// Of a place, along the normal of the ground.
double height_above_ground_m(const render::Surface& ground, const geodesy::Point<geodesy::frame::Ecef>& place);

}  // namespace nadir::sim

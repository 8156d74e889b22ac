#pragma once

#include "nadir/geodesy/attitude.h"
#include "nadir/geodesy/geodetic.h"
#include "nadir/sim/rigid_body.h"

namespace nadir::sim {

/// What an autopilot knows of its flight. Filled from the truth here; a navigation system may fill it with estimates.
/// Position is in the tangent plane of a scene's origin, attitude and velocity against north and down at the vehicle's
/// place.
struct Navigation {
  double north_m = 0, east_m = 0;
  double height_m = 0;    // above that plane
  double course_rad = 0;  // direction of motion over ground, clockwise from north; 0 at rest
  double ground_speed_mps = 0;
  double climb_rate_mps = 0;
  double airspeed_mps = 0;
  geodesy::YawPitchRoll attitude;
  Eigen::Vector3d rates_radps = Eigen::Vector3d::Zero();  // body axes
};

Navigation true_navigation(const BodyState& state, const Environment& environment, const Eigen::Vector3d& wind_ned_mps,
                           const geodesy::LocalFrame& scene);

}  // namespace nadir::sim

#pragma once

#include <utility>
#include <vector>

#include "nadir/base/random.h"
#include "nadir/sim/area.h"
#include "nadir/sim/mission.h"

namespace nadir::sim {

/// What a random path keeps to.
struct RandomPathOrder {
  std::pair<double, double> height_m;                          // least and most, above the scene's tangent plane
  std::pair<double, double> turn_radius_m;                     // least and most, > 0
  double max_slope = 0.1;                                      // climb or descent per metre in plan, >= 0
  std::optional<std::pair<double, double>> airspeed_mps = {};  // least and most
  double margin_m = 0;                                         // to the area's edge
  double length_m = 0;                                         // at least so long
  bool start_known = true;  // the start's course is that in which it is left; else the first way is not looked at
};

/// Waypoints with courses, joined by Dubins paths that stay in the area, margin included; so does a circle to the right
/// of the largest of the radii at each of them, and hence the last circle of a mission. Uniform in place, course and
/// the rest, as far as the limits let them be: of candidates in the order of their draws, the first one that keeps to
/// them is taken; where none does, the search goes back and takes another one before. If the start lies outside or is
/// not known, so may the way to the first of them.
/// They depend on the stream, the start and the order alone. Fails where the area holds no circle of the largest
/// radius, and where nothing is found after many draws, with the figures of both.
Result<std::vector<Waypoint>> random_path(const Area& area, const RandomPathOrder& order, const Waypoint& start,
                                          const RandomStream& stream);

}  // namespace nadir::sim

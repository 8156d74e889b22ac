#include <cmath>

#include "nadir/sim/flight_plan.h"

namespace nadir::sim {
namespace {

/// Straight from one point to another, near the ground on purpose.
void add_low_way(std::vector<PlannedPoint>& path, const Waypoint& from, const Waypoint& to, std::size_t item,
                 double spacing_m) {
  const Eigen::Vector2d way(to.north_m - from.north_m, to.east_m - from.east_m);
  const double length_m = way.norm(), climb_m = to.height_m - from.height_m;
  if (!(length_m > 0)) return;
  const auto steps = static_cast<int>(std::ceil(length_m / spacing_m));
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    path.push_back({.north_m = from.north_m + share * way.x(),
                    .east_m = from.east_m + share * way.y(),
                    .height_m = from.height_m + share * climb_m,
                    .course_rad = std::atan2(way.y(), way.x()),
                    .slope = climb_m / length_m,
                    .length_m = length_m / (steps + 1),
                    .airspeed_mps = to.airspeed_mps,
                    .item = item,
                    .low = true});
  }
}

}  // namespace

std::vector<PlannedPoint> planned_path(const FlightPlan& plan, double spacing_m) {
  std::vector<PlannedPoint> path;
  if (plan.ground.takeoff) add_low_way(path, plan.begin, plan.start, 0, spacing_m);
  const std::vector<PlannedPoint> mission = planned_points(plan.mission, spacing_m);
  path.insert(path.end(), mission.begin(), mission.end());
  if (const auto& landing = plan.ground.landing) {
    const PlannedPoint& last = mission.back();
    const Runway& runway = landing->runway;
    add_low_way(path, {last.north_m, last.east_m, last.height_m},
                {runway.from.x(), runway.from.y(), runway.height_m, {}, {}, landing->airspeed_mps}, last.item,
                spacing_m);
  }
  return path;
}

}  // namespace nadir::sim

#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "nadir/sim/area.h"
#include "nadir/sim/mission.h"

namespace nadir::sim {

/// How an area is to be photographed, in parallel lines flown to and fro.
struct SurveyOrder {
  /// What a camera sees for certain in level flight: metres forward and to the right of the vehicle.
  Eigen::AlignedBox2d seen_m;
  double forward_overlap = 0.6, side_overlap = 0.3;  // of what neighbours in a line, and lines, see; [0, 0.95]
  std::optional<double> heading_rad = {};            // of the lines, clockwise from north; else with the fewest turns
  double height_m = 0;                               // above the scene's tangent plane
  double lead_in_m = 0, lead_out_m = 0;              // flown straight before and after the exposures of a line
  double turn_radius_m = 0;                          // between lines; 0: turns on the spot
  std::optional<double> airspeed_mps = {};
  std::optional<Eigen::Vector2d> from = {};  // where the vehicle comes from: begins at the nearest of the four ends
};

struct SurveyPlan {
  std::vector<Waypoint> waypoints;  // with courses: beginning and end of each line, lead-in and lead-out included
  double heading_rad = 0;           // of the first line
  int lines = 0;
  double line_spacing_m = 0;      // of what neighbouring lines see; at most what the side overlap asks for
  double exposure_spacing_m = 0;  // at most, over ground: what the forward overlap asks for
  int seen_at_least = 1;          // times each point of the area is: floor(1 / (1 - overlap)) a line, and lines
};

/// Every point of the area, its edge included, is seen as often as both overlaps promise, wherever along a line the
/// first exposure falls. For it, lines begin and end where their first and last exposures have just left the area.
/// Of the orders of lines below the one with the shortest way is flown: one after the other; or in blocks, by turns in
/// one half of a block and in the other, so that no turn is tighter than half the distance between them. Neighbours
/// closer than two radii would be joined by turns that swing out to three radii and change sides.
/// Fails where an overlap is out of range, nothing is seen, or more than 10000 lines would be needed.
/// Of directions the best is along an edge of the area: a width is least across one (Freeman and Shapira, Determining
/// the minimum-area encasing rectangle for an arbitrary closed curve, 1975).
Result<SurveyPlan> plan_survey(const Area& area, const SurveyOrder& order);

}  // namespace nadir::sim

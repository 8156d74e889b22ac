#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/sim/mission.h"

namespace nadir::sim {

/// What a vehicle with its autopilot can do.
struct FlightLimits {
  double airspeed_mps = 25;      // where a mission names none
  double max_bank_rad = 0.7854;  // that its autopilot asks for
  double max_climb_mps = 3;      // either way
  double near_ground_m = 20;     // lower is doubtful
  double max_airspeed_mps = 0;   // of vehicles that keep their motion over ground
};

/// What a planned path meets: the wind there, towards north and east, and the height above ground.
struct PlanSurroundings {
  Eigen::Vector2d wind_mps = Eigen::Vector2d::Zero();
  double above_ground_m = 0;
};

/// Something about the way to an item of a mission.
struct PlanFinding {
  std::size_t item = 0;
  bool impossible = false;  // else doubtful
  std::string message;
};

struct PlanCheck {
  std::vector<PlanFinding> findings;  // by item; of each kind the worst place only
  double seconds = 0;                 // that the path takes; infinite where the wind lets it not be flown
};

/// Looks at a path, as planned, before it is flown: climbs against the limit at the speed over ground, turns against
/// the bank that they take with the wind behind, the ground, and headway against the wind. What reaches seven eighths
/// of a limit, or comes nearer to the ground than 20 m, is doubtful; beyond it is impossible. A corner
/// without an arc is doubtful that leads 10 m off the path by the tightest turn's geometry. Where motion over ground
/// is kept, the airspeed that it takes in the wind is looked at in place of turns and headway, and of climbs those
/// upwards.
Result<PlanCheck> check_plan(std::span<const PlannedPoint> points, const FlightLimits& limits,
                             const std::function<Result<PlanSurroundings>(const PlannedPoint&)>& surroundings);

/// Along a course, of a vehicle that keeps it by crabbing; not positive where the wind does not let it.
double ground_speed_mps(double airspeed_mps, double course_rad, const Eigen::Vector2d& wind_mps);

}  // namespace nadir::sim

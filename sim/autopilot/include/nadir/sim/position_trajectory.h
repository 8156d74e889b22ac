#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "nadir/sim/mission.h"

namespace nadir::sim {

/// A point to fly to, by a vehicle that can stop.
struct PositionWaypoint {
  Waypoint at;
  std::optional<double> hold_s;     // stops there for so long; else its corner is rounded and it is passed by
  std::optional<double> speed_mps;  // on the way to it; else the limit
  std::optional<double> yaw_rad;    // from the beginning of the way to it
};

/// Of the motion asked for.
struct TrajectoryLimits {
  double speed_mps = 5;  // along the way
  double climb_mps = 2, descent_mps = 1.5;
  double acceleration_mps2 = 2;
};

/// Where a trajectory is at a time: north, east, down in the scene's tangent plane.
struct TrajectoryPoint {
  Eigen::Vector3d position_ned_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_ned_mps2 = Eigen::Vector3d::Zero();
  std::size_t waypoint = 0;  // that is flown to, or held at
};

/// From rest through waypoints as a function of time: straight at constant speed, and around each corner, start and
/// stop a change of velocity within which acceleration rises and falls as a parabola. Speed and acceleration stay
/// within the limits, all derivatives up to the acceleration are continuous. A corner that turns the velocity by dv is
/// passed at 9 dv^2 / (64 a). Where a leg is too short for its corners, it is flown more slowly.
class PositionTrajectory {
 public:
  /// Fails where there is no waypoint, where a number is not finite or a limit not positive, where neighbours are less
  /// than a centimetre apart. `repeat`: after the last waypoint comes the first again, for ever.
  static Result<PositionTrajectory> create(const Waypoint& start, std::span<const PositionWaypoint> waypoints,
                                           const TrajectoryLimits& limits, bool repeat = false);

  /// Before 0 as at 0; after the end it rests at the last waypoint.
  TrajectoryPoint at(double time_s) const;

  /// When the last waypoint is reached; none for one that repeats.
  std::optional<double> end_s() const { return period_s_ > 0 ? std::nullopt : std::optional(end_s_); }

 private:
  /// Constant velocity from a point, up to the next knot; around the knot at its beginning the velocity changes.
  struct Leg {
    double from_s = 0;
    Eigen::Vector3d from_m, velocity_mps;
    double change_s = 0;  // how long the change of velocity around `from_s` takes
    std::size_t waypoint = 0;
  };
  PositionTrajectory() = default;

  std::vector<Leg> legs_;  // the first and the last at rest
  double end_s_ = 0;
  double again_from_s_ = 0, period_s_ = 0;  // where it repeats: from then on, after this
};

}  // namespace nadir::sim

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/sim/path.h"

namespace nadir::sim {

/// A point to fly by, in the tangent plane of the scene's origin.
struct Waypoint {
  double north_m = 0, east_m = 0;
  double height_m = 0;  // above that plane
};

/// What comes after the last waypoint.
enum class AfterMission {
  Circle,  // a circle to the right that touches the last leg in the last waypoint
  Repeat,  // the first waypoint again, for ever
};

/// Legs between waypoints, joined by arcs (fillets) that touch both: corners are cut, and nothing is overshot.
/// Where a corner is too sharp or its legs too short for an arc, the next leg begins at the waypoint.
/// The whole path is laid out beforehand; what changes in flight is which piece of it is flown. One thread at a time.
class Mission {
 public:
  /// `start`: where the first leg begins. `turn_radius_m` > 0: of fillets and of the last circle.
  /// Fails where there is no waypoint, where neighbours are less than a metre apart in plan (a vertical leg cannot be
  /// flown), or where a number is not finite.
  static Result<Mission> create(const Waypoint& start, std::span<const Waypoint> waypoints, double turn_radius_m,
                                AfterMission after = AfterMission::Circle);

  /// The piece of path to fly from `now` on. A piece ends where the vehicle passes the plane across its end.
  const Path& path_at(const Navigation& now);

  /// True once the vehicle has passed the last waypoint; never for a mission that repeats.
  bool finished() const { return !repeats_ && current_ + 1 == pieces_.size(); }

 private:
  struct Piece {
    Path path;
    Eigen::Vector2d end;      // a point of the plane across the end
    Eigen::Vector2d onwards;  // its normal: unit direction of the flight there
  };
  Mission() = default;

  std::vector<Piece> pieces_;  // at least one
  bool repeats_ = false;
  std::size_t again_ = 0;  // the piece after the last one, where the mission repeats
  std::size_t current_ = 0;
};

}  // namespace nadir::sim

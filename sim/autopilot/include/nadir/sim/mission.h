#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/sim/path.h"

namespace nadir::sim {

/// A point to fly by, in the tangent plane of the scene's origin.
struct Waypoint {
  double north_m = 0, east_m = 0;
  double height_m = 0;  // above that plane
  /// Passed exactly there and in this direction, reached and left by Dubins paths. Without it the corner is cut.
  std::optional<double> course_rad = {};
  /// Of the turns on the way to it and at it, else the mission's. 0: no turn; what comes next begins at the waypoint.
  std::optional<double> turn_radius_m = {};
  std::optional<double> airspeed_mps = {};  // on the way to it, else the vehicle's own
};

/// A circle to fly, reached and left along tangents; one without turns or seconds is flown for ever.
struct Orbit {
  double north_m = 0, east_m = 0, height_m = 0;  // of its centre
  double radius_m = 0;                           // > 0
  bool clockwise = true;
  std::optional<double> turns = {};         // at least so many, > 0, and on to where the way to what comes next begins
  std::optional<double> seconds = {};       // the same by time
  std::optional<double> airspeed_mps = {};  // on the way to it and on it
};
using MissionItem = std::variant<Waypoint, Orbit>;

/// What comes after the last item.
enum class AfterMission {
  Circle,  // an orbit goes on; from a waypoint a circle to the right that touches the way to it there
  Repeat,  // the first item again, for ever
  GoesOn,  // nothing of the mission: something else flies on from its end, such as a landing
};

/// What is wrong with an item of a mission, counted from 0; none where it is the mission as a whole.
struct MissionFault {
  std::optional<std::size_t> item;
  std::string message;
};

/// A change of course without an arc, since the one that was asked for has no room.
struct SharpCorner {
  double turn_rad = 0;
  double fitting_radius_m = 0;  // of the largest arc that has; 0 of a course turned back by more than 165 degrees
};

/// A piece of a mission's path as planned.
struct MissionPiece {
  Path path;
  Eigen::Vector2d begin, end;  // north, east, of what is flown of the path: a fillet cuts the ends of its legs off
  double turn_rad = 0;  // flown of a circle; of one for a time or for ever: once round and on to where it is left
  bool leaves = true;   // a circle: not flown for ever
  std::optional<double> seconds = {};       // a circle: left once so much time has passed
  std::optional<double> airspeed_mps = {};  // else the vehicle's own
  std::size_t item = 0;                     // that it leads to
  std::optional<SharpCorner> corner = {};   // at its end

  double length_m() const;  // in plan
};

/// How a vehicle passes a place that keeps its motion over ground whatever the wind, and its nose where it is told.
struct KeptMotion {
  double ground_speed_mps = 0, climb_mps = 0;
  double yaw_rad = 0;
  double seconds = 0;  // that the place stands for
};

/// A place along a mission's path as planned.
struct PlannedPoint {
  double north_m = 0, east_m = 0, height_m = 0;
  double course_rad = 0;
  double curve_per_m = 0;  // to the right
  double slope = 0;        // climb per metre in plan
  double length_m = 0;     // of the path that it stands for; 0 on a circle that is flown for ever
  std::optional<double> airspeed_mps = {};
  std::size_t item = 0;                 // that the path leads to there
  std::optional<KeptMotion> kept = {};  // of a vehicle that can hover
  std::optional<SharpCorner> corner = {};
  bool low = false;  // on the way from the ground or down to it, which is near it on purpose
};

/// The path along waypoints and orbits. Legs between plain waypoints are straight, joined by arcs (fillets) that touch
/// both: corners are cut, and nothing is overshot; where a corner is too sharp or its legs too short for an arc, the
/// next leg begins at the waypoint. Waypoints with a course, and what follows them, are joined by Dubins paths. The
/// whole path is laid out beforehand; what changes in flight is which piece of it is flown. One thread at a time.
class Mission {
 public:
  /// All that forbids such a mission, in the order of its items: values that cannot be, neighbours less than a metre
  /// apart in plan (a vertical leg cannot be flown), items that are never reached.
  static std::vector<MissionFault> faults(const Waypoint& start, std::span<const MissionItem> items,
                                          double turn_radius_m, AfterMission after = AfterMission::Circle);

  /// `start`: where the first way begins; left in its course, by a Dubins path. Without one the first way begins in any
  /// direction, or towards north where it leads to a waypoint with a course. `turn_radius_m` > 0: of fillets, of Dubins
  /// paths and of the last circle. Fails with all faults.
  static Result<Mission> create(const Waypoint& start, std::span<const MissionItem> items, double turn_radius_m,
                                AfterMission after = AfterMission::Circle);

  /// The piece of path to fly from `now` on. A straight ends where the vehicle passes the plane across its end, an arc
  /// where it has gone round far enough. `time_s` never falls.
  const MissionPiece& piece_at(const Navigation& now, double time_s);

  /// True once the vehicle has passed the last waypoint, or is on the last orbit; where something goes on, once it has
  /// passed the last item. Never for a mission that repeats.
  bool finished() const { return finished_; }

  /// In the order of the flight; of a mission that repeats, the way to its first item and two rounds.
  std::span<const MissionPiece> pieces() const { return pieces_; }

 private:
  Mission() = default;
  bool passed(const MissionPiece& piece, const Navigation& now, double time_s);

  std::vector<MissionPiece> pieces_;  // at least one
  AfterMission after_ = AfterMission::Circle;
  std::size_t again_ = 0;  // the piece after the last one, where the mission repeats
  std::size_t current_ = 0;
  bool finished_ = false;

  struct Round {  // on the circle that is flown now
    double bearing_rad = 0, turned_rad = 0, since_s = 0;
    double to_turn_rad = std::numeric_limits<double>::infinity();
  };
  std::optional<Round> round_;
};

/// The planned path in steps of at most `spacing_m` > 0, each piece from its beginning to its end.
std::vector<PlannedPoint> planned_points(const Mission& mission, double spacing_m);

}  // namespace nadir::sim

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nadir/sim/path.h"

namespace nadir::sim {

/// Where a way in plan begins or ends; (north, east) in metres.
struct WayEnd {
  enum class Kind {
    Point,   // left and reached in any direction
    Pose,    // with a course
    Circle,  // along a tangent
  };
  Kind kind = Kind::Point;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  // of a circle its centre
  double course_rad = 0;                            // of a pose; of a circle that is left: where its first turn began
  double radius_m = 0;                              // of a circle, > 0
  bool clockwise = true;                            // of a circle

  static WayEnd point(const Eigen::Vector2d& place) { return {Kind::Point, place}; }
  static WayEnd pose(const Eigen::Vector2d& place, double course_rad) { return {Kind::Pose, place, course_rad}; }
  static WayEnd circle(const Eigen::Vector2d& center, double radius_m, bool clockwise, double course_rad = 0) {
    return {Kind::Circle, center, course_rad, radius_m, clockwise};
  }
};

/// A way in plan whose course never jumps: straights, and turns of one radius.
struct Way {
  std::string word;          // of its turns (R, L) and straight (S): "RSL"; ends without a turn have no letter
  std::vector<Path> pieces;  // heights 0; none shorter than a micrometre
  double length_m = 0;
  double first_turn_rad = 0;      // of the first piece where the way leaves a pose or a circle with a turn, else 0
  double arrival_course_rad = 0;  // where it ends
};

/// The shortest way with turns of `radius_m` > 0. Between two poses it is Dubins' path, of all six words; of equally
/// long ones the first of RSR, RSL, LSR, LSL, RLR, LRL; from a pose to a point one of RS, LS, RL, LR. On a circle that
/// is left, the turn is that circle's own. Nothing where a circle has no tangent to the other end: a point within it,
/// or a circle within a circle. Source: Dubins, On curves of minimal length with a constraint on average curvature,
/// 1957.
std::optional<Way> shortest_way(const WayEnd& from, const WayEnd& to, double radius_m);

}  // namespace nadir::sim

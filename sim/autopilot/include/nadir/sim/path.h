#pragma once

#include <Eigen/Core>
#include <optional>
#include <variant>

#include "nadir/sim/navigation.h"

namespace nadir::sim {

/// Straight from one point to another and on beyond. Horizontal coordinates are (north, east) in metres; the two points
/// are apart.
struct StraightPath {
  Eigen::Vector2d from, to;
  double from_height_m = 0, to_height_m = 0;  // between and beyond them, linear in distance
};

/// Around a point, from the direction in which `from_rad` (clockwise from north) lies from the centre.
/// The height changes evenly over `sweep_rad` and stays from there on.
struct CirclePath {
  Eigen::Vector2d center;
  double radius_m = 0;  // > 0
  bool clockwise = true;
  double from_rad = 0, sweep_rad = 0;  // sweep >= 0, in the sense of the flight
  double from_height_m = 0, to_height_m = 0;
};
using Path = std::variant<StraightPath, CirclePath>;

/// From its beginning to its end, in plan.
double length_m(const Path& path);

/// What the loops are to follow in this moment.
struct Guidance {
  double course_rad = 0;
  double roll_rad = 0;  // bank that the path's own curve needs
  double height_m = 0;
  double climb_rate_mps = 0;                // that the path's own slope needs
  std::optional<double> airspeed_mps = {};  // else the one that the vehicle flies at anyway
};

/// How fast a vehicle closes in on a path.
struct PathGains {
  double approach_rad = 1.0472;  // course towards a line from far away, (0, pi/2)
  double line_per_m = 0.03;      // how sharply that fades near the line
  double circle = 5;             // the same around a circle, in units of its radius
};

/// Vector field around the path: a course that leads onto it and along it, from wherever the vehicle is.
/// Source: Beard and McLain, Small Unmanned Aircraft, 2012, equations 10.8 and 10.13.
Guidance follow(const Path& path, const Navigation& now, const PathGains& gains);

/// How far the vehicle is off: metres to the right of the path, and above it.
struct PathError {
  double right_m = 0, above_m = 0;
};
PathError path_error(const Path& path, const Navigation& now);

}  // namespace nadir::sim

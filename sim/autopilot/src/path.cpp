#include "nadir/sim/path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {
using Eigen::Vector2d;
constexpr double pi = std::numbers::pi;
constexpr double gravity_mps2 = 9.81;  // of a bank that guidance asks for in advance; the course loop mends the rest

Vector2d horizontal(const Navigation& now) { return {now.north_m, now.east_m}; }

double straight_right_m(const StraightPath& line, const Navigation& now) {
  const Vector2d along = (line.to - line.from).normalized(), off = horizontal(now) - line.from;
  return along.x() * off.y() - along.y() * off.x();
}
double straight_height_m(const StraightPath& line, const Navigation& now) {
  const Vector2d whole = line.to - line.from;
  const double share = whole.dot(horizontal(now) - line.from) / whole.squaredNorm();
  return line.from_height_m + share * (line.to_height_m - line.from_height_m);
}

/// Share of the sweep that is flown: 0 to 1, and 1 for the rest of the circle. Half the rest counts as not begun, for a
/// vehicle that arrives a little early.
double circle_share(const CirclePath& circle, double bearing_rad) {
  if (circle.sweep_rad <= 0) return 1;
  const double sense = circle.clockwise ? 1 : -1;
  double flown = std::fmod(sense * (bearing_rad - circle.from_rad), 2 * pi);
  if (flown < 0) flown += 2 * pi;
  if (flown > circle.sweep_rad + (2 * pi - circle.sweep_rad) / 2) return 0;
  return std::min(1.0, flown / circle.sweep_rad);
}

Guidance follow_straight(const StraightPath& line, const Navigation& now, const PathGains& gains) {
  const Vector2d whole = line.to - line.from;
  const double along_rad = std::atan2(whole.y(), whole.x());
  const double right_m = straight_right_m(line, now);
  const double slope = (line.to_height_m - line.from_height_m) / whole.norm();
  return {.course_rad = along_rad - gains.approach_rad * (2 / pi) * std::atan(gains.line_per_m * right_m),
          .roll_rad = 0,
          .height_m = straight_height_m(line, now),
          .climb_rate_mps = slope * now.ground_speed_mps * std::cos(now.course_rad - along_rad),
          .airspeed_mps = {}};
}

Guidance follow_circle(const CirclePath& circle, const Navigation& now, const PathGains& gains) {
  const Vector2d off = horizontal(now) - circle.center;
  const double bearing = std::atan2(off.y(), off.x()), sense = circle.clockwise ? 1 : -1;
  const double outside = (off.norm() - circle.radius_m) / circle.radius_m;
  const double share = circle_share(circle, bearing);

  Guidance out;
  out.course_rad = bearing + sense * (pi / 2 + std::atan(gains.circle * outside));
  // In wind the nose does not point along the course, and only the part of lift across the course bends the path. Far
  // off the circle there is nothing to bend yet.
  const double crab = std::cos(now.course_rad - now.attitude.yaw_rad);
  const double bend =
      now.ground_speed_mps * now.ground_speed_mps / (gravity_mps2 * circle.radius_m * std::max(0.5, crab));
  out.roll_rad = sense * std::atan(bend) * std::max(0.0, 1 - std::abs(outside));
  out.height_m = circle.from_height_m + share * (circle.to_height_m - circle.from_height_m);
  if (share > 0 && share < 1)
    out.climb_rate_mps =
        (circle.to_height_m - circle.from_height_m) / (circle.sweep_rad * circle.radius_m) * now.ground_speed_mps;
  return out;
}

}  // namespace

double length_m(const Path& path) {
  if (const auto* line = std::get_if<StraightPath>(&path)) return (line->to - line->from).norm();
  const auto& circle = std::get<CirclePath>(path);
  return circle.radius_m * circle.sweep_rad;
}

Guidance follow(const Path& path, const Navigation& now, const PathGains& gains) {
  if (const auto* line = std::get_if<StraightPath>(&path)) return follow_straight(*line, now, gains);
  return follow_circle(std::get<CirclePath>(path), now, gains);
}

PathError path_error(const Path& path, const Navigation& now) {
  if (const auto* line = std::get_if<StraightPath>(&path))
    return {straight_right_m(*line, now), now.height_m - straight_height_m(*line, now)};
  const auto& circle = std::get<CirclePath>(path);
  const Vector2d off = horizontal(now) - circle.center;
  const double outside_m = off.norm() - circle.radius_m;
  const double share = circle_share(circle, std::atan2(off.y(), off.x()));
  return {circle.clockwise ? -outside_m : outside_m,
          now.height_m - (circle.from_height_m + share * (circle.to_height_m - circle.from_height_m))};
}

}  // namespace nadir::sim

#include "nadir/sim/mission.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {
using Eigen::Vector2d;

Vector2d plan(const Waypoint& w) { return {w.north_m, w.east_m}; }
double bearing_rad(const Vector2d& v) { return std::atan2(v.y(), v.x()); }

/// An arc that touches two legs, as far from their corner as `cut_m`.
struct Fillet {
  CirclePath arc;
  double cut_m = 0;
};

/// The fillet between the legs a-b and b-c; without radius where the course changes by less than a thousandth of a
/// radian, by more than 165 degrees, or where half a leg is too short for it.
Fillet fillet_between(const Waypoint& a, const Waypoint& b, const Waypoint& c, double radius_m) {
  const Vector2d in = plan(b) - plan(a), out = plan(c) - plan(b);
  const Vector2d u = in.normalized(), v = out.normalized();
  const double cross = u.x() * v.y() - u.y() * v.x(), dot = u.dot(v);
  const double turn = std::atan2(std::abs(cross), dot);
  if (turn < 1e-3 || turn > 165 * (std::numbers::pi / 180)) return {};

  Fillet fillet;
  fillet.cut_m = radius_m * std::tan(turn / 2);
  if (fillet.cut_m > 0.5 * std::min(in.norm(), out.norm())) return {};
  const double sense = cross > 0 ? 1 : -1;
  const Vector2d entry = plan(b) - fillet.cut_m * u;
  const Vector2d right(-u.y(), u.x());
  fillet.arc.center = entry + sense * radius_m * right;
  fillet.arc.radius_m = radius_m;
  fillet.arc.clockwise = sense > 0;
  fillet.arc.from_rad = bearing_rad(entry - fillet.arc.center);
  fillet.arc.sweep_rad = turn;
  fillet.arc.from_height_m = b.height_m - (b.height_m - a.height_m) * fillet.cut_m / in.norm();
  fillet.arc.to_height_m = b.height_m + (c.height_m - b.height_m) * fillet.cut_m / out.norm();
  return fillet;
}

bool finite(const Waypoint& w) {
  return std::isfinite(w.north_m) && std::isfinite(w.east_m) && std::isfinite(w.height_m);
}

}  // namespace

Result<Mission> Mission::create(const Waypoint& start, std::span<const Waypoint> waypoints, double turn_radius_m,
                                AfterMission after) {
  // The corners in the order of the flight. One that repeats closes its round and goes on towards the second waypoint,
  // so that the corner at the first one is known for later rounds too.
  std::vector<Waypoint> corners{start};
  corners.insert(corners.end(), waypoints.begin(), waypoints.end());
  if (waypoints.empty()) return fail(Error::Kind::Malformed, "mission: expected at least one waypoint, found none");
  if (!(turn_radius_m > 0))
    return fail(Error::Kind::Malformed,
                fmt::format("mission: expected a turn radius above 0, found {} m", turn_radius_m));
  const bool repeats = after == AfterMission::Repeat;
  if (repeats) {
    if (waypoints.size() < 2)
      return fail(Error::Kind::Malformed, "mission: expected at least two waypoints to repeat, found one");
    corners.push_back(waypoints[0]);
    corners.push_back(waypoints[1]);
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto name = [&](std::size_t k) {
      return k == 0 ? std::string("the start") : fmt::format("waypoint {}", (k - 1) % waypoints.size() + 1);
    };
    if (!finite(corners[i]))
      return fail(Error::Kind::Malformed, fmt::format("mission: {}: a coordinate is not a finite number", name(i)));
    if (i > 0 && !((plan(corners[i]) - plan(corners[i - 1])).norm() >= 1))
      return fail(Error::Kind::Malformed,
                  fmt::format("mission: {} and {} are less than 1 m apart in plan", name(i - 1), name(i)));
  }

  // Lay the path: each leg up to its fillet, then the fillet.
  Mission mission;
  mission.repeats_ = repeats;
  const std::size_t legs = repeats ? corners.size() - 2 : corners.size() - 1;
  for (std::size_t i = 0; i < legs; ++i) {
    const Waypoint &a = corners[i], &b = corners[i + 1];
    const Vector2d along = (plan(b) - plan(a)).normalized();
    const Fillet fillet = i + 2 < corners.size() ? fillet_between(a, b, corners[i + 2], turn_radius_m) : Fillet{};
    if (repeats && i == 1) mission.again_ = mission.pieces_.size();
    mission.pieces_.push_back(
        {StraightPath{plan(a), plan(b), a.height_m, b.height_m}, plan(b) - fillet.cut_m * along, along});
    if (fillet.cut_m > 0) {
      const Vector2d next = (plan(corners[i + 2]) - plan(b)).normalized();
      mission.pieces_.push_back({fillet.arc, plan(b) + fillet.cut_m * next, next});
    }
  }
  if (!repeats) {
    const Waypoint &last = corners.back(), &before = corners[corners.size() - 2];
    const Vector2d along = (plan(last) - plan(before)).normalized(), right(-along.y(), along.x());
    CirclePath circle;
    circle.center = plan(last) + turn_radius_m * right;
    circle.radius_m = turn_radius_m;
    circle.from_height_m = circle.to_height_m = last.height_m;
    mission.pieces_.push_back({circle, plan(last), along});
  }
  return mission;
}

const Path& Mission::path_at(const Navigation& now) {
  const Vector2d here(now.north_m, now.east_m);
  // At most one round: pieces end in turn, and a vehicle that is not finite passes nothing.
  for (std::size_t passed = 0; passed < pieces_.size() && !finished(); ++passed) {
    const Piece& piece = pieces_[current_];
    if (!((here - piece.end).dot(piece.onwards) >= 0)) break;
    current_ = current_ + 1 < pieces_.size() ? current_ + 1 : again_;
  }
  return pieces_[current_].path;
}

}  // namespace nadir::sim

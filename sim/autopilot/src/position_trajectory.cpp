#include "nadir/sim/position_trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace nadir::sim {
namespace {

using Eigen::Vector3d;

Vector3d ned(const Waypoint& w) { return {w.north_m, w.east_m, -w.height_m}; }

/// Greatest speed along a way.
double speed_along(const Vector3d& way, double speed_mps, const TrajectoryLimits& limits) {
  const double vertical = std::abs(way.z());
  if (vertical == 0) return speed_mps;
  return std::min(speed_mps, (way.z() < 0 ? limits.climb_mps : limits.descent_mps) * way.norm() / vertical);
}

Result<void> check(const Waypoint& start, std::span<const PositionWaypoint> waypoints, const TrajectoryLimits& limits,
                   bool repeat) {
  const auto malformed = [](std::string message) -> Result<void> {
    return fail(Error::Kind::Malformed, "trajectory: " + message);
  };
  if (waypoints.size() < (repeat ? 2 : 1))
    return malformed(
        fmt::format("expected at least {} waypoint{}, found {}", repeat ? 2 : 1, repeat ? "s" : "", waypoints.size()));
  for (const double limit : {limits.speed_mps, limits.climb_mps, limits.descent_mps, limits.acceleration_mps2})
    if (!(limit > 0) || !std::isfinite(limit))
      return malformed(fmt::format("expected limits of speed and acceleration above 0, found {}", limit));
  Vector3d before = ned(start);
  if (!before.allFinite()) return malformed("the start is not finite");
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const PositionWaypoint& w = waypoints[i];
    const Vector3d here = ned(w.at);
    if (!here.allFinite() || !std::isfinite(w.yaw_rad.value_or(0)))
      return malformed(fmt::format("waypoint {}: a coordinate is not a finite number", i + 1));
    if (!(w.hold_s.value_or(0) >= 0) || !std::isfinite(w.hold_s.value_or(0)))
      return malformed(fmt::format("waypoint {}: expected to hold for 0 s or more, found {}", i + 1, *w.hold_s));
    if (!(w.speed_mps.value_or(1) > 0) || !std::isfinite(w.speed_mps.value_or(1)))
      return malformed(fmt::format("waypoint {}: expected a speed above 0, found {}", i + 1, *w.speed_mps));
    if (!((here - before).norm() >= 0.01))
      return malformed(fmt::format("{} and waypoint {} are less than 1 cm apart",
                                   i == 0 ? std::string("the start") : fmt::format("waypoint {}", i), i + 1));
    before = here;
  }
  if (repeat && !((ned(waypoints.front().at) - before).norm() >= 0.01))
    return malformed("the last waypoint and the first are less than 1 cm apart");
  return {};
}

/// A way at constant velocity, or a stop for some time, between changes of velocity.
struct Piece {
  Vector3d from, way;
  double speed_mps = 0;  // 0: a stop
  double hold_s = 0;
  std::size_t waypoint = 0;
  Vector3d velocity() const { return speed_mps > 0 ? Vector3d(speed_mps * way.normalized()) : Vector3d::Zero(); }
};

}  // namespace

Result<PositionTrajectory> PositionTrajectory::create(const Waypoint& start,
                                                      std::span<const PositionWaypoint> waypoints,
                                                      const TrajectoryLimits& limits, bool repeat) {
  if (auto ok = check(start, waypoints, limits, repeat); !ok) return fail(ok);

  // Stops and ways. One that repeats goes on for three more, which are the same as in its first round but for where the
  // first of them comes from and where the last goes.
  std::vector<Piece> pieces{{ned(start), Vector3d::Zero(), 0, 0, 0}};
  std::vector<std::size_t> ways;  // pieces that are not stops
  const std::size_t legs = waypoints.size() + (repeat ? 3 : 0);
  Vector3d from = ned(start);
  for (std::size_t i = 0; i < legs; ++i) {
    const std::size_t index = i % waypoints.size();
    const PositionWaypoint& w = waypoints[index];
    ways.push_back(pieces.size());
    const Vector3d way = ned(w.at) - from;
    pieces.push_back({from, way, speed_along(way, w.speed_mps.value_or(limits.speed_mps), limits), 0, index});
    from = ned(w.at);
    if (w.hold_s && i + 1 < legs) pieces.push_back({from, Vector3d::Zero(), 0, *w.hold_s, index});
  }
  pieces.push_back({from, Vector3d::Zero(), 0, 0, (legs - 1) % waypoints.size()});

  // Changes of velocity between pieces; acceleration rises to its limit in their middle. Ways that are too short for
  // the changes at their ends are flown more slowly.
  const auto change_s = [&](std::size_t i) {  // between pieces i - 1 and i
    return 1.5 * (pieces[i].velocity() - pieces[i - 1].velocity()).norm() / limits.acceleration_mps2;
  };
  for (bool slower = true; slower;) {
    slower = false;
    for (std::size_t i = 1; i + 1 < pieces.size(); ++i) {
      Piece& piece = pieces[i];
      if (piece.speed_mps > 0 && 0.5 * (change_s(i) + change_s(i + 1)) > piece.way.norm() / piece.speed_mps) {
        piece.speed_mps *= 0.97;
        slower = true;
      }
    }
    for (const std::size_t leg : {std::size_t{1}, std::size_t{2}})
      if (repeat) {
        double &first = pieces[ways[leg]].speed_mps, &again = pieces[ways[leg + waypoints.size()]].speed_mps;
        slower = slower || first != again;
        first = again = std::min(first, again);
      }
  }

  PositionTrajectory made;
  double time_s = 0.5 * change_s(1);
  made.legs_.push_back({0, pieces[0].from, Vector3d::Zero(), 0, 0});
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    const Piece& piece = pieces[i];
    made.legs_.push_back({time_s, piece.from, piece.velocity(), change_s(i), piece.waypoint});
    if (i + 1 == pieces.size()) break;
    time_s +=
        piece.speed_mps > 0 ? piece.way.norm() / piece.speed_mps : piece.hold_s + 0.5 * (change_s(i) + change_s(i + 1));
  }
  made.end_s_ = time_s + 0.5 * made.legs_.back().change_s;
  if (repeat) {  // at the end of the way to the second waypoint both rounds are straight, and go on alike
    const Leg &first = made.legs_[ways[1] + 1], &again = made.legs_[ways[1 + waypoints.size()] + 1];
    made.again_from_s_ = first.from_s - 0.5 * first.change_s;
    made.period_s_ = again.from_s - first.from_s;
  }
  return made;
}

TrajectoryPoint PositionTrajectory::at(double time_s) const {
  double t = std::max(0.0, time_s);
  if (period_s_ > 0 && t > again_from_s_) t = again_from_s_ + std::fmod(t - again_from_s_, period_s_);
  const auto next =
      std::upper_bound(legs_.begin(), legs_.end(), t, [](double time, const Leg& leg) { return time < leg.from_s; });
  auto leg = std::prev(next);
  TrajectoryPoint out;
  out.waypoint = leg->waypoint;
  // A change of velocity lies half before and half after its knot
  if (next != legs_.end() && next->from_s - t < 0.5 * next->change_s) leg = next;
  out.position_ned_m = leg->from_m + (t - leg->from_s) * leg->velocity_mps;
  out.velocity_ned_mps = leg->velocity_mps;
  const double into_s = t - (leg->from_s - 0.5 * leg->change_s);
  if (leg != legs_.begin() && into_s < leg->change_s) {
    const Vector3d before = std::prev(leg)->velocity_mps, change = leg->velocity_mps - before;
    const double share = into_s / leg->change_s, square = share * share;
    out.position_ned_m = leg->from_m - 0.5 * leg->change_s * before + into_s * before +
                         leg->change_s * square * share * (1 - 0.5 * share) * change;
    out.velocity_ned_mps = before + square * (3 - 2 * share) * change;
    out.acceleration_ned_mps2 = 6 * share * (1 - share) / leg->change_s * change;
  }
  return out;
}

}  // namespace nadir::sim

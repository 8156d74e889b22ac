#include "nadir/sim/multirotor_pilot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nadir::sim {

const char* to_string(MultirotorPhase phase) {
  switch (phase) {
    case MultirotorPhase::Standing:
      return "standing";
    case MultirotorPhase::TakeOff:
      return "take-off";
    case MultirotorPhase::Mission:
      return "mission";
    case MultirotorPhase::Hover:
      return "hover";
    case MultirotorPhase::Landing:
      return "landing";
    case MultirotorPhase::Landed:
      break;
  }
  return "landed";
}

Result<MultirotorPilot> MultirotorPilot::create(const MultirotorMission& mission, double max_yaw_rate_radps) {
  MultirotorPilot pilot;
  pilot.mission_ = mission;
  pilot.max_yaw_rate_radps_ = max_yaw_rate_radps;
  pilot.yaw_rad_ = pilot.wanted_yaw_rad_ = mission.yaw_rad;

  // Take-off, mission and landing are one trajectory
  std::vector<PositionWaypoint> points;
  Waypoint begin = mission.start;
  if (mission.from_ground) {
    begin.height_m += mission.take_off_height_m;
    points.push_back({.at = begin, .hold_s = 1, .speed_mps = mission.take_off_mps, .yaw_rad = {}});
    pilot.phase_ = MultirotorPhase::Standing;
  }
  if (mission.from_ground && mission.repeat)
    return fail(Error::Kind::Unsupported, "mission: one that repeats begins in the air: start it at a height");
  if (mission.repeat && mission.land)
    return fail(Error::Kind::Malformed, "mission: one that repeats does not land: choose one of both");
  pilot.first_ = points.size();
  points.insert(points.end(), mission.waypoints.begin(), mission.waypoints.end());
  if (points.empty()) points.push_back({.at = begin, .hold_s = {}, .speed_mps = {}, .yaw_rad = {}});
  pilot.last_ = points.size();
  if (mission.land) {
    for (std::size_t i = pilot.first_; i < points.size(); ++i)
      if (points[i].at.height_m < mission.ground_height_m)
        return fail(Error::Kind::Malformed,
                    fmt::format("mission: waypoint {} is {:.1f} m under the ground to land on", i - pilot.first_ + 1,
                                mission.ground_height_m - points[i].at.height_m));
    if (!(mission.landing_mps > 0) || !std::isfinite(mission.landing_mps))
      return fail(Error::Kind::Malformed,
                  fmt::format("mission: expected a landing speed above 0, found {} m/s", mission.landing_mps));
    if (!points.back().hold_s) points.back().hold_s = 0;
    Waypoint below = points.back().at;
    const double slow_m = mission.ground_height_m + mission.approach_height_m;
    if (below.height_m > slow_m + 0.1) {
      below.height_m = slow_m;
      points.push_back({.at = below, .hold_s = {}, .speed_mps = {}, .yaw_rad = {}});
    }
    below.height_m = mission.ground_height_m - 100;  // on until it stands
    points.push_back({.at = below, .hold_s = {}, .speed_mps = mission.landing_mps, .yaw_rad = {}});
  }
  // One point at the start: it hovers there
  if (points.size() == 1 && mission.waypoints.empty() && !mission.from_ground) points.front().at.height_m += 0.01;
  auto way = PositionTrajectory::create(mission.start, points, mission.limits, mission.repeat);
  if (!way) return fail(way);
  pilot.way_.push_back(std::move(*way));
  return pilot;
}

double MultirotorPilot::wanted_yaw(const TrajectoryPoint& point) {
  const std::size_t index = point.waypoint - first_;  // wraps before the first, which no list is as long as
  if (index < mission_.waypoints.size() && mission_.waypoints[index].yaw_rad) return *mission_.waypoints[index].yaw_rad;
  const Eigen::Vector3d& v = point.velocity_ned_mps;
  if (mission_.face_along && v.head<2>().norm() > 0.5) return std::atan2(v.y(), v.x());
  return wanted_yaw_rad_;
}

MultirotorSetpoint MultirotorPilot::setpoint(double time_s, double dt_s, bool on_ground) {
  const TrajectoryPoint point = way_.front().at(time_s);
  waypoint_ = point.waypoint < first_ ? 0 : std::min(point.waypoint - first_, mission_.waypoints.size());

  // Where in the flight it is
  const auto end_s = way_.front().end_s();
  if (phase_ != MultirotorPhase::Landed) {
    if (point.waypoint >= last_)
      phase_ = on_ground ? MultirotorPhase::Landed : MultirotorPhase::Landing;
    else if (mission_.from_ground && point.waypoint < first_)
      phase_ = on_ground ? MultirotorPhase::Standing : MultirotorPhase::TakeOff;
    else
      phase_ = end_s && time_s >= *end_s ? MultirotorPhase::Hover : MultirotorPhase::Mission;
  }

  // The nose goes to where it is wanted no faster than it may, by the shorter way; straight behind, to the right
  wanted_yaw_rad_ = wanted_yaw(point);
  double off = std::remainder(wanted_yaw_rad_ - yaw_rad_, 2 * std::numbers::pi);
  if (off < -std::numbers::pi + 1e-6) off += 2 * std::numbers::pi;
  const double most = 0.8 * max_yaw_rate_radps_ * dt_s;  // the rest is for errors
  const double turn = std::clamp(off, -most, most);
  yaw_rad_ = std::remainder(yaw_rad_ + turn, 2 * std::numbers::pi);
  return {.position_ned_m = point.position_ned_m,
          .velocity_ned_mps = point.velocity_ned_mps,
          .acceleration_ned_mps2 = point.acceleration_ned_mps2,
          .yaw_rad = yaw_rad_,
          .yaw_rate_radps = turn / dt_s};
}

Result<std::vector<PlannedPoint>> planned_points(const MultirotorMission& mission, double step_s, double until_s) {
  auto pilot = MultirotorPilot::create(mission, MultirotorGains().max_yaw_rate_radps);
  if (!pilot) return fail(pilot);
  const double end_s = pilot->end_s().value_or(until_s);
  step_s = std::max(step_s, end_s / 20000);
  std::vector<PlannedPoint> points;
  for (int i = 0; i * step_s <= end_s; ++i) {
    const MultirotorSetpoint at = pilot->setpoint(i * step_s, step_s, false);
    const bool landing = pilot->phase() == MultirotorPhase::Landing;
    if (landing && -at.position_ned_m.z() < mission.ground_height_m) break;
    const Eigen::Vector3d& v = at.velocity_ned_mps;
    const double speed_mps = v.head<2>().norm();
    points.push_back({.north_m = at.position_ned_m.x(),
                      .east_m = at.position_ned_m.y(),
                      .height_m = -at.position_ned_m.z(),
                      .course_rad = speed_mps > 0 ? std::atan2(v.y(), v.x()) : at.yaw_rad,
                      .length_m = speed_mps * step_s,
                      .item = std::min(pilot->waypoint(), std::max<std::size_t>(mission.waypoints.size(), 1) - 1),
                      .kept = KeptMotion{speed_mps, -v.z(), at.yaw_rad, step_s},
                      .low = landing || pilot->phase() == MultirotorPhase::TakeOff});
  }
  return points;
}

}  // namespace nadir::sim

#pragma once

#include <vector>

#include "nadir/sim/multirotor_control.h"
#include "nadir/sim/position_trajectory.h"

namespace nadir::sim {

/// A flight from take-off to landing.
struct MultirotorMission {
  Waypoint start;
  double yaw_rad = 0;  // at the start, and until a waypoint or the way says another
  bool from_ground = false;
  double take_off_height_m = 3, take_off_mps = 1;  // above the start, where it begins on the ground
  std::vector<PositionWaypoint> waypoints;
  bool repeat = false;
  bool face_along = false;                          // nose along the way where no waypoint says a yaw; else it stays
  bool land = false;                                // below the last waypoint; else it hovers there
  double ground_height_m = 0;                       // where it lands, in the scene
  double approach_height_m = 5, landing_mps = 0.5;  // slow from that height on
  TrajectoryLimits limits;
};

/// What a multirotor is doing.
enum class MultirotorPhase { Standing, TakeOff, Mission, Hover, Landing, Landed };
const char* to_string(MultirotorPhase phase);

/// Makes set points of a mission as time passes. After the touchdown it asks for nothing: rotors are off. One thread at
/// a time.
class MultirotorPilot {
 public:
  /// Fails where the trajectory of the mission does, or where a waypoint lies under the ground that it lands on.
  static Result<MultirotorPilot> create(const MultirotorMission& mission, double max_yaw_rate_radps);

  /// At a time since the start. `on_ground`: whether it stands.
  MultirotorSetpoint setpoint(double time_s, double dt_s, bool on_ground);
  MultirotorPhase phase() const { return phase_; }
  /// Whether rotors are to stand still.
  bool rotors_off() const { return phase_ == MultirotorPhase::Landed; }
  std::size_t waypoint() const { return waypoint_; }
  /// When the last waypoint is reached; none for a mission that repeats.
  std::optional<double> end_s() const { return way_.front().end_s(); }

 private:
  MultirotorPilot() = default;
  double wanted_yaw(const TrajectoryPoint& point);

  MultirotorMission mission_;
  std::vector<PositionTrajectory> way_;  // one
  std::size_t first_ = 0, last_ = 0;     // of the mission's waypoints among the trajectory's
  double yaw_rad_ = 0, wanted_yaw_rad_ = 0, max_yaw_rate_radps_ = 1;
  MultirotorPhase phase_ = MultirotorPhase::Mission;
  std::size_t waypoint_ = 0;
};

/// A mission as it is asked for, in steps of `step_s` > 0 (longer ones where they would be more than 20000), until it
/// has landed or reached its last waypoint; one that repeats until a time. Items are its waypoints. Fails where the
/// pilot does.
Result<std::vector<PlannedPoint>> planned_points(const MultirotorMission& mission, double step_s, double until_s);

}  // namespace nadir::sim

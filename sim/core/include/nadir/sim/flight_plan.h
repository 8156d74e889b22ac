#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/geodesy/attitude.h"
#include "nadir/render/camera.h"
#include "nadir/render/surface.h"
#include "nadir/sim/flown_fixed_wing.h"
#include "nadir/sim/mission.h"
#include "nadir/sim/multirotor_pilot.h"
#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// A camera of a vehicle, for surveys.
struct VehicleCamera {
  std::string_view name;
  const render::Camera* camera = nullptr;
  geodesy::Pose<geodesy::frame::Body, geodesy::frame::Camera> body_from_camera;
};

/// What a survey of a mission came to.
struct PlannedSurvey {
  std::size_t item = 0;  // of the vehicle's mission
  std::string sensor;
  int lines = 0, seen_at_least = 1;
  double heading_rad = 0, line_spacing_m = 0, exposure_spacing_m = 0;
  double rate_hz = 0;  // reaches the forward overlap along the faster way, with the wind of the place
};

/// What is known of a planned mission, of whatever kind its vehicle is.
struct PlannedMission {
  std::vector<std::size_t> setup_item;  // of VehicleSetup::mission, by PlannedPoint::item; empty without items
  std::vector<PlannedSurvey> surveys;
};

/// A fixed wing's mission made into a path.
struct FlightPlan : PlannedMission {
  Waypoint begin;               // where the vehicle is at first
  FixedWingGroundSetup ground;  // how it leaves the ground before the mission, and comes back after it
  Waypoint start;               // of the mission: where the climb-out ends, if it takes off
  Mission mission;              // without items: straight on, farther than the run lasts
};

/// A multirotor's mission, from take-off to landing.
struct MultirotorPlan : PlannedMission {
  MultirotorMission mission;
};

/// Fails with all faults of the mission, each with its line of the run file. Surveys see with `cameras`, in level
/// flight in the wind of the place; random paths are by the run's seed, the vehicle's name and their place in the
/// mission.
Result<FlightPlan> plan_mission(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                                const render::Surface& ground, std::span<const VehicleCamera> cameras);

Result<MultirotorPlan> plan_multirotor_mission(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                                               const render::Surface& ground, std::span<const VehicleCamera> cameras);

/// The whole path in steps of at most `spacing_m`: take-off, mission, glide to the touch-down point.
std::vector<PlannedPoint> planned_path(const FlightPlan& plan, double spacing_m);
/// The same of a multirotor in steps of half a second, as far as its mission goes; where that repeats, until a time.
std::vector<PlannedPoint> planned_path(const MultirotorPlan& plan, double until_s);

/// The greatest box, sides along and across the course, around the middle of what a camera sees of level ground
/// `height_m` below the vehicle, in level flight with that attitude, yaw counted from the course; less a fiftieth
/// of the height on each side, for what attitude and place swing about in flight. Metres forward and to the right.
/// Empty where it sees the horizon. Error: a hundredth of its sides, none of an upright camera's.
Eigen::AlignedBox2d seen_for_certain(const VehicleCamera& camera, double height_m,
                                     const geodesy::YawPitchRoll& course_from_body);

/// "run.yaml:17: 'vehicles.plane1.mission[2]': message".
std::string mission_message(const RunFile& run, const MissionItemSetup& item, const std::string& message);

}  // namespace nadir::sim

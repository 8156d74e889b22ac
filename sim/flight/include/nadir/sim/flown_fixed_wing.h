#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>

#include "nadir/sim/air_along_path.h"
#include "nadir/sim/closed_loop_modes.h"
#include "nadir/sim/flown_vehicle.h"
#include "nadir/sim/integrator.h"
#include "nadir/sim/landing.h"
#include "nadir/sim/landing_gear.h"
#include "nadir/sim/mission.h"
#include "nadir/sim/takeoff.h"

namespace nadir::sim {

/// What an airframe stands; beyond it, it has crashed.
struct AirframeLimits {
  double sink_mps = std::numeric_limits<double>::infinity();     // of a wheel that meets the ground
  double bank_rad = std::numeric_limits<double>::infinity();     // at touch-down
  double load_factor = std::numeric_limits<double>::infinity();  // specific force over 9.81 m/s^2, mean of a period
};

/// The ground that a flight goes over, begins on or ends on.
struct FixedWingGroundSetup {
  std::shared_ptr<const Ground> ground;
  bool standing = false;  // begins at rest on its gear under `start`
  double launch_mps = 0;  // else above 0: airspeed of a launch, level at this pitch; else in trim
  double launch_pitch_rad = 0;
  std::optional<TakeoffPlan> takeoff;  // before the mission
  std::optional<LandingPlan> landing;  // once the mission is finished, which then ends with its `approach`, and goes on
  AirframeLimits limits;
};

/// How a fixed wing is to fly: from trim at a place, from a launch, or from standing on its gear.
struct FixedWingFlight {
  FixedWing vehicle;
  Environment environment;
  geodesy::LocalFrame scene;  // that the mission's coordinates are in
  geodesy::Geodetic start;
  double yaw_rad = 0, airspeed_mps = 25;
  Eigen::Vector3d wind_ned_mps = Eigen::Vector3d::Zero();  // at the start: it begins carried along
  Mission mission;
  std::function<void(FlightGains&)> change_gains;            // those that follow from the vehicle's derivatives
  bool fly_unstable = false;                                 // with gains whose loops are not stable
  std::optional<FixedWingGroundSetup> ground;                // none: there is nothing to meet
  double tolerance_m = 1e-3;                                 // of steps that adapt
  Scheme scheme{.method = Scheme::Method::Rk4, .steps = 4};  // of a period
};

/// Fails where the vehicle has no steady flight there at that airspeed, or at that of its approach, or where its loops
/// are unstable. Channels: elevator, aileron, rudder; with a gear, how many of its points are in the ground, the force
/// there, steering and brake. Events: lift-off, touch-down, landed, crash.
Result<std::unique_ptr<FlownVehicle>> fly_fixed_wing(FixedWingFlight flight);

/// Where a take-off's climb-out ends in such air, and in which course: where its mission is to begin. Found by flying
/// it; the flight's own mission is not looked at. Fails where it crashes, or has not climbed out after three minutes.
Result<Waypoint> climb_out_end(FixedWingFlight flight, AirAlongPath air);

}  // namespace nadir::sim

#pragma once

#include <optional>
#include <string>

#include "nadir/base/yaml.h"
#include "nadir/render/surface.h"
#include "nadir/sim/flown_fixed_wing.h"

namespace nadir::sim {

/// `takeoff:` of a vehicle. The runway's line goes through the start, towards its yaw.
struct TakeoffSetup {
  std::optional<double> launch_mps;  // airspeed that a hand or a catapult gives; else it rolls
  double launch_pitch_deg = 10;
  double rotate_mps = 16, rotate_pitch_deg = 8;
  double climb_mps = 3, clear_m = 20;
};

/// `land:` of a vehicle: where the wheels are to touch, and how it comes there.
struct LandingSetup {
  double north_m = 0, east_m = 0, yaw_deg = 0;
  double glide_deg = 4, approach_height_m = 50, straight_m = 300;
  double airspeed_mps = 18;
};

/// `limits:` of a vehicle: beyond them it has crashed. None: whatever its gear stands.
struct LimitsSetup {
  std::optional<double> sink_mps, bank_deg, load_factor;
};

/// How a vehicle leaves the ground, comes back to it, and what it stands.
struct GroundSetup {
  std::optional<TakeoffSetup> takeoff;
  std::optional<LandingSetup> land;
  LimitsSetup limits;
};

/// Of a vehicle's map; notes faults in it.
GroundSetup read_ground(const YamlMap& vehicle);

/// Lines of a vehicle, complete with defaults.
std::string ground_text(const GroundSetup& setup);

/// The ground of a scene as gear meets it.
std::shared_ptr<const Ground> ground_of(const render::Surface& surface);

/// How a vehicle flies over that ground. `start`: of its centre of mass; `on_ground`: it stands there.
/// Fails where it cannot: it has no wheels to roll or land on.
Result<FixedWingGroundSetup> ground_flight(const GroundSetup& setup, const FixedWing& vehicle,
                                           const render::Surface& surface, const Waypoint& start, double yaw_rad,
                                           bool on_ground);

}  // namespace nadir::sim

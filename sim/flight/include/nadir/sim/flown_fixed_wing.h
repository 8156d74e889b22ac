#pragma once

#include <functional>
#include <memory>

#include "nadir/sim/closed_loop_modes.h"
#include "nadir/sim/flown_vehicle.h"
#include "nadir/sim/integrator.h"
#include "nadir/sim/mission.h"

namespace nadir::sim {

/// How a fixed wing is to fly, from trim at a place.
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
  double tolerance_m = 1e-3;                                 // of steps that adapt
  Scheme scheme{.method = Scheme::Method::Rk4, .steps = 4};  // of a period
};

/// Fails where the vehicle has no steady flight there at that airspeed, or where its loops are unstable. Channels:
/// elevator, aileron, rudder.
Result<std::unique_ptr<FlownVehicle>> fly_fixed_wing(FixedWingFlight flight);

}  // namespace nadir::sim

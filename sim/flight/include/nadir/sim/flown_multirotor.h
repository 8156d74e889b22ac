#pragma once

#include <memory>

#include "nadir/sim/flown_vehicle.h"
#include "nadir/sim/gain_design.h"
#include "nadir/sim/ground.h"
#include "nadir/sim/integrator.h"
#include "nadir/sim/multirotor_pilot.h"

namespace nadir::sim {

/// How a multirotor is to fly: from hover in the wind of its start, or from standing on the ground, parallel to it.
struct MultirotorFlight {
  Multirotor vehicle;
  Environment environment;
  geodesy::LocalFrame scene;  // that the mission's coordinates are in
  MultirotorMission mission;
  Eigen::Vector3d wind_ned_mps = Eigen::Vector3d::Zero();  // at the start
  double charge_share = 1;                                 // of a battery, at the start
  std::shared_ptr<const Ground> ground = {};               // that it stands on by its gear; none: nothing to meet
  /// Currents of motors with inductance are integrated rather than taken as settled: stiff, and for studies of them.
  bool integrate_currents = false;
  double tolerance_m = 1e-3;                                 // of steps that adapt
  Scheme scheme{.method = Scheme::Method::Rk4, .steps = 4};  // of a period
};

/// Fails where the vehicle cannot be, cannot hover there, or its mission cannot be flown; the message lists all that is
/// wrong with the vehicle. Channels: throttle and thrust of each rotor, speeds of electric ones, voltage, current and
/// charge of a battery, over ground how many points of its gear are in it and the force there, the waypoint. Events:
/// lift-off, touch-down, crash, battery empty.
Result<std::unique_ptr<FlownVehicle>> fly_multirotor(MultirotorFlight flight);

}  // namespace nadir::sim

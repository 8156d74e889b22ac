#pragma once

#include <functional>
#include <memory>

#include "nadir/sim/flown_vehicle.h"
#include "nadir/sim/gain_design.h"
#include "nadir/sim/integrator.h"
#include "nadir/sim/multirotor_pilot.h"

namespace nadir::sim {

/// The flat ground below a multirotor, for ground effect, take-off and landing. It stands on it as it came down,
/// without springs: it neither slides nor tips, and leaves it once its rotors lift it.
struct MultirotorGround {
  std::function<double(const geodesy::Point<geodesy::frame::Ecef>&)> height_above_m;  // none: there is no ground
  double legs_m = 0.15;       // height of the centre of mass where it stands
  double most_touch_mps = 3;  // faster into the ground is a crash, and so is a touch at more than this tilt
  double most_touch_tilt_rad = 0.5236;
};

/// How a multirotor is to fly: from hover in the wind of its start, or from standing on the ground.
struct MultirotorFlight {
  Multirotor vehicle;
  Environment environment;
  geodesy::LocalFrame scene;  // that the mission's coordinates are in
  MultirotorMission mission;
  Eigen::Vector3d wind_ned_mps = Eigen::Vector3d::Zero();  // at the start
  double charge_share = 1;                                 // of a battery, at the start
  MultirotorGround ground = {};
  /// Currents of motors with inductance are integrated rather than taken as settled: stiff, and for studies of them.
  bool integrate_currents = false;
  double tolerance_m = 1e-3;                                 // of steps that adapt
  Scheme scheme{.method = Scheme::Method::Rk4, .steps = 4};  // of a period
};

/// Fails where the vehicle cannot be, cannot hover there, or its mission cannot be flown; the message lists all that is
/// wrong with the vehicle. Channels: throttle and thrust of each rotor, speeds of electric ones, voltage, current and
/// charge of a battery, the waypoint. Events: lift-off, touch-down, crash, battery empty; seen where periods end.
Result<std::unique_ptr<FlownVehicle>> fly_multirotor(MultirotorFlight flight);

}  // namespace nadir::sim

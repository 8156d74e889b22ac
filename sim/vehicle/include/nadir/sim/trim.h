#pragma once

#include "nadir/geodesy/attitude.h"
#include "nadir/sim/fixed_wing.h"

namespace nadir::sim {

/// A steady flight to look for: straight or in a circle, level or climbing, without side-slip, in still air.
struct TrimTarget {
  double airspeed_mps = 25;
  double climb_angle_rad = 0;  // of the path against the horizontal
  double turn_radius_m = 0;    // of the path seen from above, positive to the right; 0: straight
};

/// A steady flight: with these controls and attitude no acceleration is left but that of the turn.
struct Trim {
  TrimTarget target;
  double alpha_rad = 0, roll_rad = 0, pitch_rad = 0;
  Eigen::Vector3d rates_radps = Eigen::Vector3d::Zero();  // body rates of the turn
  Controls controls;
  PropulsionOutput propeller;
  double residual = 0;  // length of what is left: accelerations in m/s^2 and rad/s^2, rate of climb in m/s
};

/// Solves for the steady flight by Newton's method, with steps halved until they help. Over a flat Earth that does not
/// turn: over the real one Coriolis' acceleration, 0.004 m/s^2 at 25 m/s, is left for whoever flies it. Fails where no
/// steady flight is found or its controls lie outside the vehicle's limits, and says which. Error: residual under 1e-9.
Result<Trim> trim(const FixedWing& vehicle, const TrimTarget& target, double density_kgpm3, double gravity_mps2);

/// For the air and gravity of a place.
Result<Trim> trim(const FixedWing& vehicle, const TrimTarget& target, const Environment& environment,
                  const geodesy::Geodetic& place);

/// A vehicle in that flight at a place, nose towards `yaw_rad`, carried along by the wind.
FixedWingState trimmed_state(const Trim& trim, const Environment& environment, const geodesy::Geodetic& place,
                             double yaw_rad, const Eigen::Vector3d& wind_ned_mps);

}  // namespace nadir::sim

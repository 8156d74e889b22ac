#pragma once

#include <optional>

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

/// Where a solver begins.
struct TrimGuess {
  double alpha_rad = 0, roll_rad = 0, pitch_rad = 0;
  Controls controls;
};

/// Solves for the steady flight by Newton's method, with steps halved until they help: from `guess` where there is one,
/// then from what balances weight, drag and pitching moment to first order. Of several steady flights it gives the one
/// that is upright and whose lift still rises with alpha: the same whatever the guess, to rounding. Over a flat Earth
/// that does not turn: over the real one Coriolis' acceleration, 0.004 m/s^2 at 25 m/s, is left for whoever flies it.
/// Fails where there is none, or where its controls lie outside the vehicle's limits, and says why. Error: residual
/// under 1e-9.
Result<Trim> trim(const FixedWing& vehicle, const TrimTarget& target, double density_kgpm3, double gravity_mps2,
                  const std::optional<TrimGuess>& guess = std::nullopt);

/// The airspeed below which a wing does not carry the weight in straight level flight, thrust and surfaces left out.
double stall_speed_mps(const FixedWing& vehicle, double density_kgpm3, double gravity_mps2);

/// For the air and gravity of a place.
Result<Trim> trim(const FixedWing& vehicle, const TrimTarget& target, const Environment& environment,
                  const geodesy::Geodetic& place);

/// A vehicle in that flight at a place, nose towards `yaw_rad`, carried along by the wind.
FixedWingState trimmed_state(const Trim& trim, const Environment& environment, const geodesy::Geodetic& place,
                             double yaw_rad, const Eigen::Vector3d& wind_ned_mps);

}  // namespace nadir::sim

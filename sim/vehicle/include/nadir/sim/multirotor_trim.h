#pragma once

#include "nadir/geodesy/attitude.h"
#include "nadir/sim/mixer.h"

namespace nadir::sim {

/// A steady flight to look for, straight, in still air far from the ground. All zero: hover.
struct MultirotorTrimTarget {
  double forward_mps = 0, right_mps = 0;  // level, seen from the heading
  double climb_mps = 0;
};

/// Where to begin to look.
struct MultirotorTrimStart {
  double roll_rad = 0, pitch_rad = 0;
  double thrust_share = 1;  // of the weight
};

/// A steady flight: no acceleration is left.
struct MultirotorTrim {
  MultirotorTrimTarget target;
  double roll_rad = 0, pitch_rad = 0;
  MultirotorControls controls;
  MultirotorOutput output;
  double residual = 0;  // length of what is left: m/s^2 and rad/s^2
};

/// Solves for the steady flight by Newton's method, with steps halved until they help; from level hover where the given
/// start leads nowhere. Over a flat Earth that does not turn. Fails where none is found or a rotor would need more than
/// it has, and says which. `charge_ah`: of the battery, where there is one. Error: residual under 1e-9.
Result<MultirotorTrim> trim(const Multirotor& vehicle, const MultirotorTrimTarget& target, double density_kgpm3,
                            double gravity_mps2, double charge_ah, const MultirotorTrimStart& start = {});

/// Sets what depends on controls and air alone to what it comes to: lags, speeds, currents.
void settle(const Multirotor& vehicle, const Environment& environment, const MultirotorControls& controls,
            const AirMotion& air, MultirotorState& state);

/// A vehicle in that flight at a place, nose towards `yaw_rad`, carried along by the wind.
MultirotorState trimmed_state(const Multirotor& vehicle, const MultirotorTrim& trim, const Environment& environment,
                              const geodesy::Geodetic& place, double yaw_rad, const Eigen::Vector3d& wind_ned_mps,
                              double charge_ah);

}  // namespace nadir::sim

#pragma once

#include "nadir/sim/multirotor.h"

namespace nadir::sim {

/// What a controller asks of rotors: a force along their common thrust, and moments about the centre of mass.
struct RotorDemand {
  double thrust_n = 0;
  Eigen::Vector3d moment_nm = Eigen::Vector3d::Zero();
};

/// Turns demands into controls, from the geometry of the rotors alone: the least-squares solution for thrusts. Where it
/// lies outside what rotors can do, roll and pitch come first (a share of them where even they do not fit), then the
/// thrust that is nearest to the demand beside them, then the share of yaw that still fits.
/// Lags are anticipated: a demand that is to be there in a given time gets the command that brings it there, as far as
/// limits allow.
class Mixer {
 public:
  /// `density_kgpm3`: of the air where it flies. Fails where thrust, roll, pitch and yaw cannot be had apart from each
  /// other: fewer than four rotors, all on a line, all turning the same way, rotors pointing against each other.
  static Result<Mixer> create(const Multirotor& vehicle, double density_kgpm3);

  struct Mix {
    RotorValues thrust_n;  // of each rotor; of lumped rotors thrust and moments
    RotorDemand given;     // what of the demand fits
    bool saturated = false;
  };
  Mix mix(const RotorDemand& demand) const;

  /// Controls for thrusts. `now`: what stands behind lags, as far as the controller knows, else empty; `lead_s`: by
  /// when thrusts are to have come, 0: leave lags to themselves. `supply_v`: of the battery, 0 where there is none.
  MultirotorControls controls_for(const RotorValues& thrust_n, const RotorValues& now, double lead_s,
                                  double supply_v) const;

  /// Unit direction of the common thrust, in the body.
  const Eigen::Vector3d& thrust_axis() const { return axis_; }
  /// Thrust of each rotor for a newton of thrust and for a newton metre of each moment. None of lumped rotors.
  const Eigen::Matrix<double, Eigen::Dynamic, 4, 0, most_rotors, 4>& thrusts() const { return thrusts_; }
  double max_thrust_n() const { return max_thrust_.sum(); }
  /// Greatest moment about each axis that leaves the thrust at `thrust_n`.
  Eigen::Vector3d max_moment_nm(double thrust_n) const;
  /// The slowest rotor's lag or, with inertia, its mechanical time constant at hover; 0 where all follow at once.
  double slowest_lag_s() const { return slowest_lag_s_; }
  /// A rotor with inertia turns the body by the torque that speeds it up too, which leads that of the air: yaw is as
  /// its torque and this times its change. 0 without inertia.
  double yaw_lead_s() const { return yaw_lead_s_; }

 private:
  Mixer() = default;
  Mix mix_lumped(const RotorDemand& demand) const;

  Multirotor vehicle_;
  double density_kgpm3_ = 0, slowest_lag_s_ = 0, yaw_lead_s_ = 0;
  Eigen::Vector3d axis_ = -Eigen::Vector3d::UnitZ();
  Eigen::Matrix<double, Eigen::Dynamic, 4, 0, most_rotors, 4> thrusts_;  // of thrust, roll, pitch, yaw
  RotorValues max_thrust_;
};

}  // namespace nadir::sim

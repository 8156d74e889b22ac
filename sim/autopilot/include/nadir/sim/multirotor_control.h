#pragma once

#include "nadir/sim/mixer.h"
#include "nadir/sim/navigation.h"

namespace nadir::sim {

/// Gains and limits of the loops, from the inside out. Each gain is the rate at which its loop closes, 1/s.
struct MultirotorGains {
  double rate_per_s = 0, rate_integral_per_s2 = 0;  // angular acceleration per rate, and per its integral
  double tilt_per_s = 0, yaw_per_s = 0;             // rate per angle
  double velocity_per_s = 0;                        // acceleration per velocity
  double disturbance_per_s = 0;                     // how fast accelerations are learnt that nobody asked for
  double position_per_s = 0;                        // velocity per position
  double lead_s = 0;                                // in which rotors with lags are driven to what is asked for

  double max_tilt_rad = 0.9599;     // 55 degrees
  double max_rate_radps = 3.14159;  // of tilt
  double max_yaw_rate_radps = 1.0;
  double max_speed_mps = 15, max_climb_mps = 4, max_descent_mps = 3;
  double max_tilt_acceleration_radps2 = 0;  // that the attitude loop counts on
  double max_yaw_acceleration_radps2 = 0;
};

/// Gains that follow from the vehicle: its rotors' lag (shortened by the lead) and the period of control set how fast
/// rates can close with a damping of 0.7, and each loop outside is slower than the one inside by a fixed ratio; angular
/// accelerations are half of what rotors can give in hover. sim/autopilot's README says how, and shows the responses.
/// Fails where rotors cannot hold thrust, roll, pitch and yaw apart or cannot carry the vehicle.
Result<MultirotorGains> multirotor_gains(const Multirotor& vehicle, double control_period_s, double density_kgpm3,
                                         double gravity_mps2);

/// Refuses gains with which the linear cascade, rotors' lag and control period included, is not stable, and says how
/// fast it would diverge.
Result<void> check(const MultirotorGains& gains, const Mixer& mixer, double control_period_s, double gravity_mps2);

/// What to follow: a position with its derivatives, north, east, down in the scene's tangent plane, and a yaw, which is
/// independent of it.
struct MultirotorSetpoint {
  Eigen::Vector3d position_ned_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_ned_mps2 = Eigen::Vector3d::Zero();
  double yaw_rad = 0, yaw_rate_radps = 0;
};

/// Cascaded loops: position to velocity to acceleration to attitude (tilt before yaw) to rates to moments to rotors.
/// Where an angle is large its loop asks for no more rate than can be braked. Wind and whatever else accelerates the
/// vehicle is learnt by comparing its velocity with what its rotors were told, limits included: nothing winds up.
/// Sources: Brescianini, Hehn and D'Andrea, Nonlinear Quadrocopter Attitude Control, 2013 (tilt and yaw apart); Chen,
/// Yang, Guo and Li, Disturbance-Observer-Based Control and Related Methods, 2016. One thread at a time.
class MultirotorControl {
 public:
  MultirotorControl(const Multirotor& vehicle, Mixer mixer, const MultirotorGains& gains, double gravity_mps2);

  /// Controls from `now` until `dt_s` later. All of them are finite and limited where `now` is finite. `supply_v`: of
  /// the battery, 0 where there is none.
  MultirotorControls step(const MultirotorSetpoint& setpoint, const Navigation& now, double dt_s, double supply_v);

  /// Begins anew, in a steady level flight with rotors where `state` says: what leans it is taken as the wind.
  void reset(const MultirotorState& state, const Navigation& now);

  bool saturated() const { return saturated_; }
  const MultirotorGains& gains() const { return gains_; }

 private:
  Eigen::Vector3d acceleration_command(const MultirotorSetpoint& setpoint, const Navigation& now) const;
  Eigen::Vector3d rate_command(const Eigen::Quaterniond& body_from_wanted, const Eigen::Vector3d& turning_body) const;
  void learn(const Eigen::Vector3d& velocity_ned_mps, double dt_s);

  Multirotor vehicle_;
  Mixer mixer_;
  MultirotorGains gains_;
  double gravity_mps2_;
  MultirotorState model_;  // of it, what stands behind lags
  Eigen::Vector3d rate_integral_radps2_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d expected_velocity_mps_ = Eigen::Vector3d::Zero(), disturbance_mps2_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d told_acceleration_mps2_ = Eigen::Vector3d::Zero();
  double yaw_drag_nm_ = 0;  // of the propellers, as told last
  bool learning_ = false, saturated_ = false;
};

}  // namespace nadir::sim

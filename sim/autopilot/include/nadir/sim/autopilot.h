#pragma once

#include "nadir/sim/navigation.h"
#include "nadir/sim/path.h"
#include "nadir/sim/trim.h"

namespace nadir::sim {

/// Controls and attitude of steady flight near one airspeed, to first order: what the loops add to, so that they mend
/// errors only.
struct FeedForward {
  Trim level;
  double pitch_per_load = 0, elevator_per_load = 0;  // change per g of load beyond one, in a turn
  double throttle_per_climb = 0;                     // per radian of climb angle
};

/// From three trims: level, in a turn of 30 degrees bank, and descending at 0.05 rad (which the motor can always do).
/// Fails where one of them does not exist.
Result<FeedForward> feed_forward(const FixedWing& vehicle, double airspeed_mps, double density_kgpm3,
                                 double gravity_mps2);

/// Gains and limits of the loops, from the inside out; SI units, radians. The defaults are for the Aerosonde between 20
/// and 30 m/s and follow from its derivatives; sim/autopilot's README says how, and shows the responses.
struct AutopilotGains {
  double roll_kp = 1.0, roll_kd = 0.05;          // aileron per roll, per roll rate
  double pitch_kp = 2.0, pitch_kd = 0.5;         // elevator per pitch, per pitch rate
  double yaw_damper = 0.2;                       // rudder per yaw rate beyond that of the turn
  double course_kp = 2.4;                        // roll per course
  double height_kp = 0.35;                       // climb rate per height, 1/s
  double climb_kp = 0.6, climb_ki = 0.15;        // climb angle per climb angle, and per its integral
  double airspeed_kp = 0.3, airspeed_ki = 0.06;  // throttle per m/s, and per its integral

  double max_roll_rad = 0.7854;     // commanded: 45 degrees
  double max_pitch_rad = 0.4363;    // 25 degrees
  double max_climb_mps = 3;         // either way
  double max_surface_rad = 0.4363;  // commanded deflections
};

/// Successive loops: course to roll to aileron; height to climb to pitch to elevator; airspeed to throttle; a yaw
/// damper. Source of the structure: Beard and McLain, Small Unmanned Aircraft, 2012, chapter 6. Different here: the
/// loops stand on the feed-forward of a real trim, turns included, and height goes through a limited rate of climb.
/// Integrators stand still while their output is limited and the error would drive it further. One thread at a time.
class Autopilot {
 public:
  explicit Autopilot(const FeedForward& feed_forward, const AutopilotGains& gains = {});

  /// Controls from `now` until `dt_s` later. All of them are finite and limited where `now` is finite.
  /// In the steady flight that the feed-forward was made for, following it, they are its controls, to rounding.
  Controls step(const Guidance& guidance, const Navigation& now, double dt_s);

 private:
  double roll_command(const Guidance& guidance, const Navigation& now) const;
  double climb_command(const Guidance& guidance, const Navigation& now) const;  // radians, against the air
  double pitch_command(double climb_rad, const Navigation& now, double load, double dt_s);
  double throttle_command(const Guidance& guidance, double climb_rad, const Navigation& now, double dt_s);
  double airspeed_for_division(const Navigation& now) const;  // never near zero

  FeedForward ff_;
  AutopilotGains gains_;
  double climb_integral_rad_ = 0;
  double airspeed_integral_ = 0;  // throttle
};

}  // namespace nadir::sim

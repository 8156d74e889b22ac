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
  double pitch_per_slow = 0, elevator_per_slow = 0;  // per (V / Va)^2 - 1 at another airspeed Va than the trim's V
  double throttle_per_climb = 0;                     // per radian of climb angle
};

/// From trims: level, in a turn of 30 degrees bank, descending at 0.05 rad (which the motor can always do), and so at
/// nine tenths of the airspeed, or at ten ninths where the vehicle cannot fly that slowly.
/// Fails where one of them does not exist.
Result<FeedForward> feed_forward(const FixedWing& vehicle, double airspeed_mps, double density_kgpm3,
                                 double gravity_mps2);

/// What holds height and airspeed together.
enum class Control {
  SuccessiveLoops,  // pitch holds the height, throttle the airspeed
  TotalEnergy,      // throttle holds the rate of their energy, pitch how it is shared
};

/// Gains and limits of the loops, from the inside out; SI units, radians. `designed_gains` finds them for a vehicle.
struct AutopilotGains {
  Control control = Control::SuccessiveLoops;
  double roll_kp = 0, roll_kd = 0;          // aileron per roll, per roll rate
  double pitch_kp = 0, pitch_kd = 0;        // elevator per pitch, per pitch rate
  double yaw_damper = 0;                    // rudder per yaw rate beyond that of the turn
  double course_kp = 0;                     // roll per course
  double height_kp = 0;                     // climb rate per height, 1/s
  double climb_kp = 0, climb_ki = 0;        // climb angle per climb angle, and per its integral
  double airspeed_kp = 0, airspeed_ki = 0;  // throttle per m/s, and per its integral

  // Of total energy, in place of those of airspeed; rates of energy are climb angles, radians.
  double acceleration_kp = 1;               // acceleration per airspeed, 1/s
  double energy_kp = 0.5, energy_ki = 0.5;  // of the throttle that such a climb needs, and per its integral

  double max_roll_rad = 0.7854;     // commanded: 45 degrees
  double max_pitch_rad = 0.4363;    // 25 degrees
  double max_climb_mps = 3;         // either way
  double max_surface_rad = 0.4363;  // commanded deflections
};

/// What an autopilot remembers from one step to the next.
struct AutopilotMemory {
  double climb_rad = 0;     // integral of the climb angle's error
  double throttle = 0;      // of the airspeed's or the energy's
  double airspeed_mps = 0;  // smoothed; for total energy
};

/// Course to roll to aileron; height to climb to pitch to elevator; a yaw damper; and height and airspeed by one of two
/// laws. Successive loops: Beard and McLain, Small Unmanned Aircraft, 2012, chapter 6. Total energy: Lambregts,
/// Vertical flight path and speed control autopilot design using total energy principles, AIAA 83-2239, 1983. Different
/// here: the loops stand on the feed-forward of a real trim, turns included, and height goes through a limited rate of
/// climb. Integrators stand still while their output is limited and the error would drive it further. One thread at a
/// time.
class Autopilot {
 public:
  Autopilot(const FeedForward& feed_forward, const AutopilotGains& gains);

  /// Controls from `now` until `dt_s` later. All of them are finite and limited where `now` is finite.
  /// In the steady flight that the feed-forward was made for, following it, they are its controls, to rounding.
  Controls step(const Guidance& guidance, const Navigation& now, double dt_s);

  const AutopilotMemory& memory() const { return memory_; }
  void remember(const AutopilotMemory& memory) { memory_ = memory; }

 private:
  struct Rates {
    double climb_rad = 0, climb_error_rad = 0;                // asked for, and what is missing
    double airspeed_error_mps = 0;                            // missing
    double acceleration_rad = 0, acceleration_error_rad = 0;  // over gravity
  };
  Rates rates(const Guidance& guidance, const Navigation& now, double dt_s);
  double roll_command(const Guidance& guidance, const Navigation& now) const;
  double climb_command(const Guidance& guidance, const Navigation& now) const;  // radians, against the air
  double pitch_command(const Rates& rates, double load, double slow_load, double dt_s);
  double slow(const Navigation& now) const;  // how much more lift coefficient it takes than at the trim's airspeed
  double throttle_command(const Rates& rates, double dt_s);
  double airspeed_for_division(const Navigation& now) const;  // never near zero

  FeedForward ff_;
  AutopilotGains gains_;
  AutopilotMemory memory_;
};

}  // namespace nadir::sim

#pragma once

#include "nadir/sim/ground_roll.h"

namespace nadir::sim {

/// How a fixed wing leaves the ground. Speeds are air speeds.
struct TakeoffPlan {
  Runway runway;
  bool launched = false;               // by hand or catapult: it is in the air from the start
  double rotate_mps = 16;              // where the nose is lifted
  double rotate_pitch_rad = 0.14;      // to; less than what the tail stands
  double rotate_elevator_rad = -0.25;  // that holds the nose there at that speed
  double airborne_m = 1;               // from this height on the loops of flight have it
  double climb_mps = 3;                // then
  double clear_m = 20;                 // up to this height, along the runway's line
};

/// Rolls, rotates and climbs out along the runway's line. One thread at a time.
class Takeoff {
 public:
  enum class Phase { Roll, Rotate, ClimbOut, Done };
  explicit Takeoff(const TakeoffPlan& plan, const AutopilotGains& gains, const GroundRollGains& roll = {});

  /// `cruise`: the autopilot that flies on afterwards, and the climb; what it has learned stays with it.
  PilotCommand step(Autopilot& cruise, const Navigation& now, const GroundSense& ground, double dt_s);
  Phase phase() const { return phase_; }
  bool done() const { return phase_ == Phase::Done; }

 private:
  TakeoffPlan plan_;
  AutopilotGains gains_;
  GroundRollGains roll_;
  Phase phase_;
};
const char* to_string(Takeoff::Phase phase);

}  // namespace nadir::sim

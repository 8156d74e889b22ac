#include "nadir/sim/takeoff.h"

#include "nadir/sim/path.h"

namespace nadir::sim {

Takeoff::Takeoff(const TakeoffPlan& plan, const AutopilotGains& gains, const GroundRollGains& roll)
    : plan_(plan), gains_(gains), roll_(roll), phase_(plan.launched ? Phase::ClimbOut : Phase::Roll) {}

PilotCommand Takeoff::step(Autopilot& cruise, const Navigation& now, const GroundSense& ground, double dt_s) {
  if (phase_ == Phase::Roll && now.airspeed_mps >= plan_.rotate_mps) phase_ = Phase::Rotate;
  if (phase_ == Phase::Rotate && !ground.on_ground && ground.height_m >= plan_.airborne_m) phase_ = Phase::ClimbOut;
  if (phase_ == Phase::ClimbOut && ground.height_m >= plan_.clear_m) phase_ = Phase::Done;

  if (phase_ == Phase::Roll || phase_ == Phase::Rotate) {
    // The nose stays where the wheels hold it until there is air enough to lift it
    const bool lifts = phase_ == Phase::Rotate;
    PilotCommand out = roll_along(plan_.runway, lifts ? plan_.rotate_pitch_rad : now.attitude.pitch_rad,
                                  lifts ? plan_.rotate_elevator_rad : 0, now, gains_, roll_);
    out.controls.throttle = 1;
    return out;
  }
  const Eigen::Vector2d from = plan_.runway.from, to = from + plan_.runway.along();
  Guidance guidance = follow(StraightPath{from, to, now.height_m, now.height_m}, now, {});
  guidance.climb_rate_mps = plan_.climb_mps;
  return {cruise.step(guidance, now, dt_s), {}};
}

const char* to_string(Takeoff::Phase phase) {
  switch (phase) {
    case Takeoff::Phase::Roll:
      return "roll";
    case Takeoff::Phase::Rotate:
      return "rotate";
    case Takeoff::Phase::ClimbOut:
      return "climb out";
    case Takeoff::Phase::Done:
      break;
  }
  return "done";
}

}  // namespace nadir::sim

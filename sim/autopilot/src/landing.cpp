#include "nadir/sim/landing.h"

#include <algorithm>
#include <cmath>

namespace nadir::sim {
namespace {

/// Weight on wheels for so long is no bounce.
constexpr double settled_s = 0.2;
constexpr double standing_mps = 0.05;

/// How far past the glide's own touch-down the flare leads: from the glide's sink to the touch-down's, exponentially.
double flare_past_m(const LandingPlan& plan, double ground_speed_mps) {
  const double sink_mps = ground_speed_mps * std::tan(plan.glide_rad);
  if (sink_mps <= plan.touchdown_sink_mps) return 0;
  const double flare_m = plan.flare_s * (sink_mps - plan.touchdown_sink_mps);
  const double flared_m = ground_speed_mps * plan.flare_s * std::log(sink_mps / plan.touchdown_sink_mps);
  return flared_m - flare_m / std::tan(plan.glide_rad);
}

}  // namespace

std::array<Waypoint, 2> approach(const LandingPlan& plan, double straight_m) {
  constexpr double fastest = 1.5;  // over ground: with the wind behind, and not yet as slow as the approach is flown
  const double glide_m =
      plan.approach_height_m / std::tan(plan.glide_rad) + flare_past_m(plan, fastest * plan.airspeed_mps);
  const auto before = [&](double distance_m) {
    const Eigen::Vector2d at = plan.runway.from - distance_m * plan.runway.along();
    return Waypoint{at.x(), at.y(), plan.runway.height_m + plan.approach_height_m};
  };
  return {before(glide_m + straight_m), before(glide_m)};
}

Landing::Landing(const LandingPlan& plan, const FeedForward& approach, const AutopilotGains& gains,
                 const GroundRollGains& roll)
    : plan_(plan), feed_forward_(approach), gains_(gains), roll_(roll), autopilot_(approach, gains) {}

StraightPath Landing::glide(const Navigation& now) const {
  const double glide_m = plan_.approach_height_m / std::tan(plan_.glide_rad);
  const Eigen::Vector2d aim = plan_.runway.from - flare_past_m(plan_, now.ground_speed_mps) * plan_.runway.along();
  const double from_m = plan_.runway.height_m + plan_.approach_height_m;
  const StraightPath glide{aim - glide_m * plan_.runway.along(), aim, from_m, plan_.runway.height_m};
  const bool before = plan_.runway.past_m(now) < (glide.from - plan_.runway.from).dot(plan_.runway.along());
  return before ? StraightPath{glide.from, glide.to, from_m, from_m} : glide;
}

PathError Landing::off_glide(const Navigation& now) const { return path_error(glide(now), now); }

PilotCommand Landing::step(const Navigation& now, const GroundSense& ground, double dt_s) {
  const double soon_m = std::max(ground.height_m + plan_.flare_lead_s * now.climb_rate_mps, 0.0);
  const double flared_mps = soon_m / plan_.flare_s + plan_.touchdown_sink_mps;
  on_ground_s_ = ground.on_ground ? on_ground_s_ + dt_s : 0;
  const double glide_mps = now.ground_speed_mps * std::tan(plan_.glide_rad);
  if (phase_ == Phase::Glide && (flared_mps < glide_mps || ground.on_ground)) phase_ = Phase::Flare;
  if (phase_ == Phase::Flare && on_ground_s_ >= settled_s) phase_ = Phase::RollOut;
  if (phase_ == Phase::RollOut && ground.on_ground && now.ground_speed_mps < standing_mps) phase_ = Phase::Stopped;

  if (phase_ == Phase::RollOut || phase_ == Phase::Stopped) {
    PilotCommand out =
        roll_along(plan_.runway, 0, feed_forward_.level.controls.surfaces.elevator_rad, now, gains_, roll_);
    out.gear.brake = phase_ == Phase::Stopped ? 1 : ground.on_ground ? plan_.brake : 0;
    if (phase_ == Phase::Stopped) out.controls.surfaces = {}, out.gear.steering_rad = 0;
    return out;
  }

  Guidance guidance = follow(glide(now), now, {});
  if (phase_ == Phase::Flare) {
    guidance.height_m = now.height_m;
    guidance.climb_rate_mps = -flared_mps;
  }
  PilotCommand out{autopilot_.step(guidance, now, dt_s), {}};
  if (phase_ == Phase::Flare && ground.height_m < plan_.align_height_m)
    out.controls.surfaces.rudder_rad = rudder_to(plan_.runway.heading_rad, now, gains_, roll_);
  if (ground.on_ground) out.controls.throttle = 0;
  return out;
}

const char* to_string(Landing::Phase phase) {
  switch (phase) {
    case Landing::Phase::Glide:
      return "glide";
    case Landing::Phase::Flare:
      return "flare";
    case Landing::Phase::RollOut:
      return "roll out";
    case Landing::Phase::Stopped:
      break;
  }
  return "stopped";
}

}  // namespace nadir::sim

#pragma once

#include <array>
#include <optional>

#include "nadir/sim/ground_roll.h"
#include "nadir/sim/mission.h"

namespace nadir::sim {

/// How a fixed wing comes down. `runway.from` is where the wheels are to touch.
struct LandingPlan {
  Runway runway;
  double glide_rad = 0.07;           // of the approach, below the horizontal
  double approach_height_m = 50;     // above the runway, from which the glide begins
  double airspeed_mps = 18;          // of the approach
  double flare_s = 2.5;              // time constant of the sink rate's fall with height
  double flare_lead_s = 0.6;         // that the vehicle's sink rate follows late by
  double touchdown_sink_mps = 0.35;  // what the flare ends with
  double align_height_m = 1.5;       // from here on the nose points along the runway, whatever the wind
  double brake = 0.7;                // on the roll
};

/// Points to fly over before the glide: one in line with the runway, and one where the glide may begin at the earliest,
/// which aims short of the touch-down point by what the flare leads past it. A mission that ends with them ends on the
/// approach. `straight_m`: between the two.
std::array<Waypoint, 2> approach(const LandingPlan& plan, double straight_m);

/// Glides, flares, touches down and rolls out. The sink rate of the flare is proportional to the height that is left,
/// and the touch-down's besides; where it begins follows from where the two glides meet. One thread at a time.
class Landing {
 public:
  enum class Phase { Glide, Flare, RollOut, Stopped };
  /// `approach`: for the approach's airspeed.
  Landing(const LandingPlan& plan, const FeedForward& approach, const AutopilotGains& gains,
          const GroundRollGains& roll = {});

  PilotCommand step(const Navigation& now, const GroundSense& ground, double dt_s);
  Phase phase() const { return phase_; }
  PathError off_glide(const Navigation& now) const;  // of the path that is flown, before the flare

 private:
  StraightPath glide(const Navigation& now) const;  // level until its beginning

  LandingPlan plan_;
  FeedForward feed_forward_;
  AutopilotGains gains_;
  GroundRollGains roll_;
  Autopilot autopilot_;
  Phase phase_ = Phase::Glide;
  double on_ground_s_ = 0;
};
const char* to_string(Landing::Phase phase);

}  // namespace nadir::sim

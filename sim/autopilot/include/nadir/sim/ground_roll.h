#pragma once

#include <Eigen/Core>

#include "nadir/sim/autopilot.h"
#include "nadir/sim/contact.h"

namespace nadir::sim {

/// What an autopilot knows of the ground: a height above it and switches in the gear.
struct GroundSense {
  double height_m = 0;     // of the centre of mass over that when standing; negative where springs give more
  bool on_ground = false;  // weight on any wheel
};

/// A line on the ground to take off or land along, in the tangent plane of the scene's origin.
struct Runway {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();  // north, east: where a roll begins, or where to touch down
  double heading_rad = 0;
  double height_m = 0;  // of a vehicle's centre of mass that stands there, above that plane

  Eigen::Vector2d along() const { return {std::cos(heading_rad), std::sin(heading_rad)}; }
  double right_m(const Navigation& now) const;  // off the line
  double past_m(const Navigation& now) const;   // beyond `from`
};

/// All that moves a vehicle on the ground and off it.
struct PilotCommand {
  Controls controls;
  GearCommand gear;
};

/// Loops for a vehicle on its wheels. Defaults: for the Aerosonde.
struct GroundRollGains {
  double line_per_m = 0.05;         // heading per metre off the line
  double most_intercept_rad = 0.3;  // towards it
  double heading_per_s = 1.5;       // turn per heading
  double wheelbase_m = 0.57;        // over the difference in steering of its ends
  double most_steering_rad = 0.35;
  double rudder_per_heading = 3, rudder_per_rate = 0.2;
};

/// With the wheelbase of a gear: of its wheels' places along the vehicle, the straight line through their shares of
/// steering. As the default where none is steered.
GroundRollGains ground_roll_gains(const ContactGear& gear);

/// Heading along the line by nose wheel and rudder, wings level by ailerons, nose at `pitch_rad` by the elevator;
/// throttle and brake are left alone. Nothing is divided by a speed below 3 m/s.
PilotCommand roll_along(const Runway& runway, double pitch_rad, double elevator_rad, const Navigation& now,
                        const AutopilotGains& gains, const GroundRollGains& roll);

/// Rudder that turns the nose to a heading.
double rudder_to(double heading_rad, const Navigation& now, const AutopilotGains& gains, const GroundRollGains& roll);

}  // namespace nadir::sim

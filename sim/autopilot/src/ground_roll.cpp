#include "nadir/sim/ground_roll.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {

double limited(double value, double limit) { return std::clamp(value, -limit, limit); }
double turn_to(double to_rad, double from_rad) { return std::remainder(to_rad - from_rad, 2 * std::numbers::pi); }

}  // namespace

double Runway::right_m(const Navigation& now) const {
  const Eigen::Vector2d off = Eigen::Vector2d(now.north_m, now.east_m) - from;
  return along().x() * off.y() - along().y() * off.x();
}

double Runway::past_m(const Navigation& now) const {
  return along().dot(Eigen::Vector2d(now.north_m, now.east_m) - from);
}

double rudder_to(double heading_rad, const Navigation& now, const AutopilotGains& gains, const GroundRollGains& roll) {
  // Positive rudder turns left
  return limited(-roll.rudder_per_heading * turn_to(heading_rad, now.attitude.yaw_rad) +
                     roll.rudder_per_rate * now.rates_radps.z(),
                 gains.max_surface_rad);
}

PilotCommand roll_along(const Runway& runway, double pitch_rad, double elevator_rad, const Navigation& now,
                        const AutopilotGains& gains, const GroundRollGains& roll) {
  const double heading_rad =
      runway.heading_rad - limited(roll.line_per_m * runway.right_m(now), roll.most_intercept_rad);
  const double turn_rad = turn_to(heading_rad, now.attitude.yaw_rad);
  PilotCommand out;
  out.gear.steering_rad = limited(
      roll.wheelbase_m * roll.heading_per_s * turn_rad / std::max(now.ground_speed_mps, 3.0), roll.most_steering_rad);
  Surfaces& surfaces = out.controls.surfaces;
  surfaces.rudder_rad = rudder_to(heading_rad, now, gains, roll);
  surfaces.aileron_rad =
      limited(-gains.roll_kp * now.attitude.roll_rad - gains.roll_kd * now.rates_radps.x(), gains.max_surface_rad);
  surfaces.elevator_rad = limited(
      elevator_rad - gains.pitch_kp * (pitch_rad - now.attitude.pitch_rad) + gains.pitch_kd * now.rates_radps.y(),
      gains.max_surface_rad);
  return out;
}

}  // namespace nadir::sim

#include "nadir/sim/ground_roll.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {

double limited(double value, double limit) { return std::clamp(value, -limit, limit); }
double turn_to(double to_rad, double from_rad) { return std::remainder(to_rad - from_rad, 2 * std::numbers::pi); }

}  // namespace

GroundRollGains ground_roll_gains(const ContactGear& gear) {
  double wheels = 0, mean_m = 0, mean_share = 0;
  const auto each_wheel = [&](const auto& take) {
    for (const ContactPoint& point : gear.points())
      if (point.kind == ContactPoint::Kind::Wheel) take(point.body_m.x(), point.steering);
  };
  each_wheel([&](double x_m, double share) { wheels += 1, mean_m += x_m, mean_share += share; });
  mean_m /= std::max(wheels, 1.0), mean_share /= std::max(wheels, 1.0);
  double spread_m2 = 0, together_m = 0;
  each_wheel([&](double x_m, double share) {
    spread_m2 += (x_m - mean_m) * (x_m - mean_m);
    together_m += (x_m - mean_m) * (share - mean_share);
  });
  GroundRollGains gains;
  if (together_m > 0) gains.wheelbase_m = spread_m2 / together_m;
  return gains;
}

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

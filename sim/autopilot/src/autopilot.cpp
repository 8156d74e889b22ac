#include "nadir/sim/autopilot.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {
constexpr double pi = std::numbers::pi;
constexpr double gravity_mps2 = 9.81;  // of feed-forward; the loops mend the rest

/// The course error to turn by. About straight behind, where rounding would choose the side, it is to the right: the
/// cut lies at -(pi - 0.1) rather than at pi.
double turn_to(double course_rad, double now_rad) {
  const double error = std::remainder(course_rad - now_rad, 2 * pi);
  return error < -(pi - 0.1) ? error + 2 * pi : error;
}

double symmetric_clamp(double value, double limit) { return std::clamp(value, -limit, limit); }

/// An integral with `change` added, unless `output` lies beyond its limits and the change would drive it further.
double integrated(double integral, double change, double output, double low, double high) {
  const bool winds_up = (output > high && change > 0) || (output < low && change < 0);
  return winds_up ? integral : integral + change;
}

}  // namespace

Result<FeedForward> feed_forward(const FixedWing& vehicle, double airspeed_mps, double density_kgpm3, double gravity) {
  constexpr double bank_rad = pi / 6, descent_rad = -0.05;
  const double radius_m = airspeed_mps * airspeed_mps / (gravity * std::tan(bank_rad));
  const auto level = trim(vehicle, {.airspeed_mps = airspeed_mps}, density_kgpm3, gravity);
  if (!level) return fail(level);
  const auto turn = trim(vehicle, {.airspeed_mps = airspeed_mps, .turn_radius_m = radius_m}, density_kgpm3, gravity);
  if (!turn) return fail(turn);
  const auto descent_at = [&](double va_mps) {
    return trim(vehicle, {.airspeed_mps = va_mps, .climb_angle_rad = descent_rad}, density_kgpm3, gravity);
  };
  const auto descent = descent_at(airspeed_mps);
  if (!descent) return fail(descent);
  double other_ratio = 0.9;
  auto other = descent_at(other_ratio * airspeed_mps);
  if (!other) other = descent_at((other_ratio = 1 / other_ratio) * airspeed_mps);
  if (!other) return fail(other);

  FeedForward ff;
  ff.level = *level;
  const double slow = 1 / (other_ratio * other_ratio) - 1;
  ff.pitch_per_slow = (other->pitch_rad - descent->pitch_rad) / slow;
  ff.elevator_per_slow = (other->controls.surfaces.elevator_rad - descent->controls.surfaces.elevator_rad) / slow;
  const double load = 1 / std::cos(turn->roll_rad) - 1;
  ff.pitch_per_load = (turn->pitch_rad - level->pitch_rad) / load;
  ff.elevator_per_load = (turn->controls.surfaces.elevator_rad - level->controls.surfaces.elevator_rad) / load;
  ff.throttle_per_climb = (descent->controls.throttle - level->controls.throttle) / descent_rad;
  return ff;
}

Autopilot::Autopilot(const FeedForward& feed_forward, const AutopilotGains& gains) : ff_(feed_forward), gains_(gains) {
  memory_.airspeed_mps = ff_.level.target.airspeed_mps;
}

double Autopilot::roll_command(const Guidance& guidance, const Navigation& now) const {
  const double straight = ff_.level.roll_rad;
  return symmetric_clamp(straight + guidance.roll_rad + gains_.course_kp * turn_to(guidance.course_rad, now.course_rad),
                         gains_.max_roll_rad);
}

double Autopilot::climb_command(const Guidance& guidance, const Navigation& now) const {
  const double wanted_mps = guidance.climb_rate_mps + gains_.height_kp * (guidance.height_m - now.height_m);
  return symmetric_clamp(wanted_mps, gains_.max_climb_mps) / airspeed_for_division(now);
}

Autopilot::Rates Autopilot::rates(const Guidance& guidance, const Navigation& now, double dt_s) {
  Rates out;
  out.climb_rad = climb_command(guidance, now);
  out.climb_error_rad = out.climb_rad - now.climb_rate_mps / airspeed_for_division(now);
  out.airspeed_error_mps = guidance.airspeed_mps.value_or(ff_.level.target.airspeed_mps) - now.airspeed_mps;
  if (gains_.control == Control::SuccessiveLoops) return out;

  // Accelerations may take as much energy as climbs, and are felt through a filter on the airspeed
  constexpr double smoothing_s = 0.3;
  const double acceleration_mps2 = (now.airspeed_mps - memory_.airspeed_mps) / smoothing_s;
  memory_.airspeed_mps += acceleration_mps2 * std::min(dt_s, smoothing_s);
  out.acceleration_rad = symmetric_clamp(gains_.acceleration_kp * out.airspeed_error_mps / gravity_mps2,
                                         gains_.max_climb_mps / ff_.level.target.airspeed_mps);
  out.acceleration_error_rad = out.acceleration_rad - acceleration_mps2 / gravity_mps2;
  return out;
}

double Autopilot::pitch_command(const Rates& rates, double load, double slow_load, double dt_s) {
  const double error_rad = rates.climb_error_rad - rates.acceleration_error_rad;
  const double base = ff_.level.pitch_rad + ff_.pitch_per_load * load + ff_.pitch_per_slow * slow_load +
                      rates.climb_rad + gains_.climb_kp * error_rad;
  memory_.climb_rad = integrated(memory_.climb_rad, gains_.climb_ki * error_rad * dt_s, base + memory_.climb_rad,
                                 -gains_.max_pitch_rad, gains_.max_pitch_rad);
  return symmetric_clamp(base + memory_.climb_rad, gains_.max_pitch_rad);
}

double Autopilot::throttle_command(const Rates& rates, double dt_s) {
  double base = ff_.level.controls.throttle + ff_.throttle_per_climb * rates.climb_rad, change = 0;
  if (gains_.control == Control::TotalEnergy) {
    const double error_rad = rates.climb_error_rad + rates.acceleration_error_rad;
    base += ff_.throttle_per_climb * (rates.acceleration_rad + gains_.energy_kp * error_rad);
    change = ff_.throttle_per_climb * gains_.energy_ki * error_rad * dt_s;
  } else {
    base += gains_.airspeed_kp * rates.airspeed_error_mps;
    change = gains_.airspeed_ki * rates.airspeed_error_mps * dt_s;
  }
  memory_.throttle = integrated(memory_.throttle, change, base + memory_.throttle, 0, 1);
  return std::clamp(base + memory_.throttle, 0.0, 1.0);
}

double Autopilot::airspeed_for_division(const Navigation& now) const {
  return std::max(now.airspeed_mps, 0.5 * ff_.level.target.airspeed_mps);
}

double Autopilot::slow(const Navigation& now) const {
  constexpr double most = 1.4;  // of airspeeds either way, beyond which it says nothing useful
  const double va = ff_.level.target.airspeed_mps;
  const double ratio = va / std::clamp(now.airspeed_mps, va / most, va * most);
  return ratio * ratio - 1;
}

Controls Autopilot::step(const Guidance& guidance, const Navigation& now, double dt_s) {
  // What the present bank asks for. Beyond 60 degrees the feed-forward, linear in load, says nothing useful.
  const double roll = now.attitude.roll_rad, bank = symmetric_clamp(roll - ff_.level.roll_rad, pi / 3);
  const double load = 1 / std::cos(bank) - 1;
  const double slow_load = slow(now) * (1 + load);
  const double turn_rate = gravity_mps2 * std::tan(bank) / airspeed_for_division(now);
  const double pitch_rate = turn_rate * std::sin(bank), yaw_rate = turn_rate * std::cos(bank);

  const double roll_error = roll_command(guidance, now) - roll;
  const Rates wanted = rates(guidance, now, dt_s);
  const double pitch_error = pitch_command(wanted, load, slow_load, dt_s) - now.attitude.pitch_rad;
  const Surfaces& level = ff_.level.controls.surfaces;

  Controls out;
  out.surfaces.aileron_rad = level.aileron_rad + gains_.roll_kp * roll_error - gains_.roll_kd * now.rates_radps.x();
  out.surfaces.elevator_rad = level.elevator_rad + ff_.elevator_per_load * load + ff_.elevator_per_slow * slow_load -
                              gains_.pitch_kp * pitch_error + gains_.pitch_kd * (now.rates_radps.y() - pitch_rate);
  out.surfaces.rudder_rad = level.rudder_rad + gains_.yaw_damper * (now.rates_radps.z() - yaw_rate);
  for (double* surface : {&out.surfaces.aileron_rad, &out.surfaces.elevator_rad, &out.surfaces.rudder_rad})
    *surface = symmetric_clamp(*surface, gains_.max_surface_rad);
  out.throttle = throttle_command(wanted, dt_s);
  return out;
}

}  // namespace nadir::sim

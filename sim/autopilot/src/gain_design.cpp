#include "nadir/sim/gain_design.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {

/// Angular accelerations and rates of a vehicle about trim: per radian, per rad/s; 1/s^2 and 1/s.
struct Derivatives {
  double roll_rate = 0, roll_aileron = 0;
  double pitch_alpha = 0, pitch_rate = 0, pitch_elevator = 0, lift_alpha = 0;
  double yaw_beta = 0, yaw_rate = 0, yaw_rudder = 0;
  double thrust_throttle = 0;  // m/s^2
};

Derivatives derivatives(const FixedWing& v, const Trim& level, double density) {
  const double va = level.target.airspeed_mps, pressure_n = 0.5 * density * va * va * v.wing_area_m2;
  const Eigen::Vector3d moments = v.mass.inertia_kgm2().diagonal();
  const double roll = pressure_n * v.span_m / moments.x(), pitch = pressure_n * v.chord_m / moments.y(),
               yaw = pressure_n * v.span_m / moments.z();
  const double span_s = v.span_m / (2 * va), chord_s = v.chord_m / (2 * va);
  constexpr double step = 1e-3;  // of throttle; thrust is quadratic in it or nearly so
  const auto thrust_n = [&](double throttle) { return propel(v.propulsion, throttle, va, density).thrust_n; };
  const double throttle = level.controls.throttle;
  return {.roll_rate = roll * v.roll.p * span_s,
          .roll_aileron = roll * v.roll.aileron,
          .pitch_alpha = pitch * v.pitch.alpha,
          .pitch_rate = pitch * v.pitch.q * chord_s,
          .pitch_elevator = -pitch * v.pitch.elevator,
          .lift_alpha = pressure_n * v.lift.alpha / (v.mass.mass_kg() * va),
          .yaw_beta = yaw * v.yaw.beta,
          .yaw_rate = yaw * v.yaw.r * span_s,
          .yaw_rudder = -yaw * v.yaw.rudder,
          .thrust_throttle = (thrust_n(throttle + step) - thrust_n(throttle - step)) / (2 * step) / v.mass.mass_kg()};
}

}  // namespace

FlightGains designed_gains(const FixedWing& vehicle, const Trim& level, double density_kgpm3, double gravity_mps2) {
  const Derivatives d = derivatives(vehicle, level, density_kgpm3);
  const double va = level.target.airspeed_mps;
  FlightGains out;
  AutopilotGains& g = out.autopilot;

  // What delays a surface, its lag and a period and a half of the autopilot, leaves phase up to here
  const double fastest_radps = 0.4 / (vehicle.servo_time_constant_s + 1.5 * control_period_s);

  // Roll: s^2 + (kd La - Lp) s + kp La
  constexpr double most_roll_kp = 2;
  const double roll_radps = std::min(fastest_radps, std::sqrt(most_roll_kp * d.roll_aileron));
  g.roll_kp = roll_radps * roll_radps / d.roll_aileron;
  g.roll_kd = std::max(0.0, (2 * 1.3 * roll_radps + d.roll_rate) / d.roll_aileron);

  // Pitch: s^2 + (kd Me - Mq + La) s + kp Me - Ma, with the lift's share of damping in it
  constexpr double most_pitch_kp = 2;
  const double own = std::max(0.0, -d.pitch_alpha);
  const double raised = std::min(most_pitch_kp * d.pitch_elevator, std::max(0.25 * fastest_radps * fastest_radps,
                                                                            1.8 * fastest_radps * fastest_radps - own));
  g.pitch_kp = raised / d.pitch_elevator;
  const double pitch_radps = std::sqrt(own + raised);
  g.pitch_kd = std::max(0.0, (2 * 0.9 * pitch_radps + d.pitch_rate) / d.pitch_elevator);

  // Yaw: the damping of the Dutch roll, s^2 + (kr Nr' - Nr) s + Nb
  const double dutch_radps = std::sqrt(std::max(0.0, d.yaw_beta));
  g.yaw_damper = std::clamp((2 * 0.7 * dutch_radps + d.yaw_rate) / d.yaw_rudder, 0.0, 1.0);

  // Course, by coordinated turns: g / V kp
  const double course_radps = roll_radps / 12;
  g.course_kp = course_radps * va / gravity_mps2;

  // Height: pitch turns the path as fast as lift follows
  g.height_kp = std::min({0.35, d.lift_alpha / 12, pitch_radps / 30});
  g.climb_kp = 0.6;
  g.climb_ki = 0.15;
  g.max_climb_mps = std::min(3.0, 0.12 * va);

  // Airspeed: thrust per throttle over mass
  g.airspeed_kp = std::min(0.5, 3.3 / d.thrust_throttle);
  g.airspeed_ki = 0.2 * g.airspeed_kp;

  out.path.line_per_m = 0.53 * course_radps / (va * out.path.approach_rad * 2 / std::numbers::pi);
  return out;
}

}  // namespace nadir::sim

#include "nadir/sim/fixed_wing.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nadir/sim/lag.h"
#include "nadir/sim/step.h"

namespace nadir::sim {
using Eigen::Vector3d;

FixedWing aerosonde() {
  FixedWing a;
  a.mass = MassProperties::create(11.0, {.jxx_kgm2 = 0.8224, .jyy_kgm2 = 1.135, .jzz_kgm2 = 1.759, .jxz_kgm2 = 0.1204})
               .value();
  a.wing_area_m2 = 0.55, a.span_m = 2.8956, a.chord_m = 0.18994;
  a.stall_alpha_rad = 0.47, a.stall_sharpness = 50;
  a.lift = {.zero = 0.23, .alpha = 5.61, .q = 7.95, .elevator = 0.13};
  a.drag = {.zero = 0.043, .elevator = 0.0135};
  a.side = {.beta = -0.98, .aileron = 0.075, .rudder = 0.19};
  a.roll = {.beta = -0.13, .p = -0.51, .r = 0.25, .aileron = 0.17, .rudder = 0.0024};
  a.pitch = {.zero = 0.0135, .alpha = -2.74, .q = -38.21, .elevator = -0.99};
  a.yaw = {.beta = 0.073, .p = 0.069, .r = -0.095, .aileron = -0.011, .rudder = -0.069};
  a.propulsion = {.diameter_m = 0.508,
                  .ct0 = 0.09357,
                  .ct1 = -0.06044,
                  .ct2 = -0.1079,
                  .cq0 = 0.005230,
                  .cq1 = 0.004970,
                  .cq2 = -0.01664,
                  .kq_vspr = 0.06586,  // of 145 rpm a volt
                  .max_voltage_v = 44.4,
                  .resistance_ohm = 0.042,
                  .no_load_current_a = 1.5};
  a.servo_time_constant_s = 0.02;
  a.max_deflection_rad = 40 * (std::numbers::pi / 180);
  return a;
}

Surfaces surfaces_after(const FixedWing& vehicle, const Surfaces& from, const Surfaces& command, double duration_s) {
  if (duration_s <= 0) return from;
  const FirstOrderLag servo(vehicle.servo_time_constant_s, duration_s);
  const double limit = vehicle.max_deflection_rad;
  const auto moved = [&](double now_rad, double command_rad) {
    return servo.held(now_rad, std::clamp(command_rad, -limit, limit));
  };
  return {moved(from.elevator_rad, command.elevator_rad), moved(from.aileron_rad, command.aileron_rad),
          moved(from.rudder_rad, command.rudder_rad)};
}

double stall_blend(const FixedWing& vehicle, double alpha_rad) {
  const double m = vehicle.stall_sharpness, a0 = vehicle.stall_alpha_rad;
  const double below = 1 / (1 + std::exp(m * (alpha_rad - a0)));
  const double above = 1 / (1 + std::exp(-m * (alpha_rad + a0)));
  return 1 - below * above;
}

double ground_effect(const FixedWing& vehicle, double height_m) {
  if (!vehicle.feels_ground || height_m >= ground_effect_spans * vehicle.span_m) return 1;
  const double s = 16 * std::max(height_m, 0.0) / vehicle.span_m;
  return s * s / (1 + s * s);
}

Loads aerodynamics(const FixedWing& vehicle, const AirData& air, const Vector3d& rates_radps, const Surfaces& surfaces,
                   double density_kgpm3, double height_m) {
  const double alpha = air.alpha_rad, va = air.airspeed_mps;
  const double pressure_n = 0.5 * density_kgpm3 * va * va * vehicle.wing_area_m2;
  const double damping_ns = 0.25 * density_kgpm3 * va * vehicle.wing_area_m2;  // dynamic pressure times area over 2 Va
  const double bp = vehicle.span_m * rates_radps.x();
  const double cq = vehicle.chord_m * rates_radps.y();
  const double br = vehicle.span_m * rates_radps.z();

  const auto newtons = [&](const Coefficient& c, double at_alpha) {
    return pressure_n * (at_alpha + c.beta * air.beta_rad + c.elevator * surfaces.elevator_rad +
                         c.aileron * surfaces.aileron_rad + c.rudder * surfaces.rudder_rad) +
           damping_ns * (c.p * bp + c.q * cq + c.r * br);
  };
  const auto linear = [&](const Coefficient& c) { return c.zero + c.alpha * alpha; };

  // The wing's lift and drag, over the stall.
  const double sin_alpha = std::sin(alpha), cos_alpha = std::cos(alpha);
  const double attached = linear(vehicle.lift);
  const double stalled = stall_blend(vehicle, alpha);
  const double flat_plate = 2 * sin_alpha * std::abs(sin_alpha) * cos_alpha;
  const double aspect_ratio = vehicle.span_m * vehicle.span_m / vehicle.wing_area_m2;
  const double induced =
      ground_effect(vehicle, height_m) * attached * attached / (std::numbers::pi * vehicle.oswald * aspect_ratio);
  const double lift_n = newtons(vehicle.lift, (1 - stalled) * attached + stalled * flat_plate);
  const double drag_n = newtons(vehicle.drag, linear(vehicle.drag) + induced);

  Loads loads;
  loads.force_body_n = {lift_n * sin_alpha - drag_n * cos_alpha, newtons(vehicle.side, linear(vehicle.side)),
                        -lift_n * cos_alpha - drag_n * sin_alpha};
  loads.moment_body_nm = {vehicle.span_m * newtons(vehicle.roll, linear(vehicle.roll)),
                          vehicle.chord_m * newtons(vehicle.pitch, linear(vehicle.pitch)),
                          vehicle.span_m * newtons(vehicle.yaw, linear(vehicle.yaw))};
  return loads;
}

Loads loads(const FixedWing& vehicle, const AirData& air, const Vector3d& rates_radps, const Surfaces& surfaces,
            double throttle, double density_kgpm3, double height_m) {
  Loads sum = aerodynamics(vehicle, air, rates_radps, surfaces, density_kgpm3, height_m);
  const PropulsionOutput propeller = propel(vehicle.propulsion, throttle, air.airspeed_mps, density_kgpm3);
  sum.force_body_n.x() += propeller.thrust_n;
  sum.moment_body_nm.x() -= propeller.torque_nm;
  return sum;
}

namespace {

double limited(double throttle) { return std::clamp(throttle, 0.0, 1.0); }

Loads loads(const FixedWing& vehicle, const BodyInAir& in_air, const Surfaces& surfaces, double throttle,
            double height_m = no_ground_m) {
  return loads(vehicle, in_air.flow, in_air.rates_against_air_radps, surfaces, limited(throttle),
               in_air.here.density_kgpm3, height_m);
}

}  // namespace

Loads loads(const FixedWing& vehicle, const Environment& environment, const FixedWingState& state,
            const Controls& controls, const AirMotion& air, double height_m) {
  return loads(vehicle, body_in_air(state, environment, air), state.surfaces, controls.throttle, height_m);
}

BodyVector derivative(const FixedWing& vehicle, const Environment& environment, const BodyVector& x,
                      const Surfaces& surfaces, double throttle, const AirMotion& air, const Loads& others,
                      double height_m) {
  const BodyState state = body_state_from_vector(x);
  const BodyInAir in_air = body_in_air(state, environment, air);
  return body_derivative(vehicle.mass, state, in_air, loads(vehicle, in_air, surfaces, throttle, height_m) + others);
}

Result<FixedWingState> advance(const FixedWing& vehicle, const Environment& environment, const FixedWingState& state,
                               const Controls& controls, const AirOverTime& air, double t_s, double dt_s) {
  const auto surfaces_at = [&](double time_s) {
    return surfaces_after(vehicle, state.surfaces, controls.surfaces, time_s - t_s);
  };
  const auto change = [&](double time_s, const BodyVector& x) {
    return derivative(vehicle, environment, x, surfaces_at(time_s), controls.throttle, air.at(time_s));
  };
  BodyVector x = rk4_step(change, t_s, to_vector(state), dt_s);
  renormalise_quaternion(x, body_quaternion_at);
  const auto finite = finite_or_error(x, t_s + dt_s);
  if (!finite) return fail(finite);
  return FixedWingState{body_state_from_vector(*finite), surfaces_at(t_s + dt_s)};
}

}  // namespace nadir::sim

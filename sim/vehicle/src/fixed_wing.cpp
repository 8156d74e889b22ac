#include "nadir/sim/fixed_wing.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nadir/sim/step.h"

namespace nadir::sim {
using Eigen::Matrix3d, Eigen::Quaterniond, Eigen::Vector3d;

FixedWing aerosonde() {
  FixedWing a;
  a.mass_kg = 11.0;
  a.jxx_kgm2 = 0.8224, a.jyy_kgm2 = 1.135, a.jzz_kgm2 = 1.759, a.jxz_kgm2 = 0.1204;
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

FixedWingVector to_vector(const FixedWingState& state) {
  FixedWingVector x;
  x << state.position.xyz, state.velocity.xyz, state.ecef_from_body.quaternion.coeffs(), state.body_rates_radps,
      state.surfaces.elevator_rad, state.surfaces.aileron_rad, state.surfaces.rudder_rad;
  return x;
}

FixedWingState state_from_vector(const FixedWingVector& x) {
  FixedWingState state;
  state.position.xyz = x.segment<3>(0);
  state.velocity.xyz = x.segment<3>(3);
  state.ecef_from_body.quaternion.coeffs() = x.segment<4>(6);
  state.body_rates_radps = x.segment<3>(10);
  state.surfaces = {x[13], x[14], x[15]};
  return state;
}

AirData air_data_from(const Vector3d& velocity_body_mps) {
  const Vector3d& v = velocity_body_mps;
  return {.velocity_body_mps = v,
          .airspeed_mps = v.norm(),
          .alpha_rad = std::atan2(v.z(), v.x()),
          .beta_rad = std::atan2(v.y(), std::sqrt(v.x() * v.x() + v.z() * v.z()))};
}

AirData air_data(const FixedWingState& state, const Environment& environment, const AirMotion& air) {
  const Vector3d wind_ecef = environment.at(state.position).ecef_from_ned * air.velocity_ned_mps;
  return air_data_from(state.ecef_from_body.quaternion.conjugate() * (state.velocity.xyz - wind_ecef));
}

double stall_blend(const FixedWing& vehicle, double alpha_rad) {
  const double m = vehicle.stall_sharpness, a0 = vehicle.stall_alpha_rad;
  const double below = 1 / (1 + std::exp(m * (alpha_rad - a0)));
  const double above = 1 / (1 + std::exp(-m * (alpha_rad + a0)));
  return 1 - below * above;
}

Loads aerodynamics(const FixedWing& vehicle, const AirData& air, const Vector3d& rates_radps, const Surfaces& surfaces,
                   double density_kgpm3) {
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
  const double induced = attached * attached / (std::numbers::pi * vehicle.oswald * aspect_ratio);
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
            double throttle, double density_kgpm3) {
  Loads sum = aerodynamics(vehicle, air, rates_radps, surfaces, density_kgpm3);
  const PropulsionOutput propeller = propel(vehicle.propulsion, throttle, air.airspeed_mps, density_kgpm3);
  sum.force_body_n.x() += propeller.thrust_n;
  sum.moment_body_nm.x() -= propeller.torque_nm;
  return sum;
}

Vector3d angular_acceleration(const FixedWing& vehicle, const Vector3d& rates_radps, const Vector3d& moment_body_nm) {
  const double jx = vehicle.jxx_kgm2, jy = vehicle.jyy_kgm2, jz = vehicle.jzz_kgm2, jxz = vehicle.jxz_kgm2;
  const Vector3d momentum(jx * rates_radps.x() - jxz * rates_radps.z(), jy * rates_radps.y(),
                          jz * rates_radps.z() - jxz * rates_radps.x());
  const Vector3d torque = moment_body_nm - rates_radps.cross(momentum);
  const double determinant = jx * jz - jxz * jxz;
  return {(jz * torque.x() + jxz * torque.z()) / determinant, torque.y() / jy,
          (jxz * torque.x() + jx * torque.z()) / determinant};
}

namespace {

double limited_throttle(const Controls& controls) { return std::clamp(controls.throttle, 0.0, 1.0); }

/// The state in the terms its forces depend on.
struct Flight {
  Surroundings here;
  Matrix3d ecef_from_body;
  Vector3d rates_radps;  // against the ground
  Loads loads;
};
Flight flight(const FixedWing& vehicle, const Environment& environment, const FixedWingState& state,
              const Controls& controls, const AirMotion& air) {
  Flight f;
  f.here = environment.at(state.position);
  f.ecef_from_body = state.ecef_from_body.quaternion.toRotationMatrix();
  const Matrix3d body_from_ecef = f.ecef_from_body.transpose();
  f.rates_radps = state.body_rates_radps - body_from_ecef * f.here.earth_rate_ecef_radps;
  const AirData flow =
      air_data_from(body_from_ecef * (state.velocity.xyz - f.here.ecef_from_ned * air.velocity_ned_mps));
  const Vector3d against_air_radps = f.rates_radps - body_from_ecef * (f.here.ecef_from_ned * air.rates_ned_radps);
  f.loads = loads(vehicle, flow, against_air_radps, state.surfaces, limited_throttle(controls), f.here.density_kgpm3);
  return f;
}

}  // namespace

Loads loads(const FixedWing& vehicle, const Environment& environment, const FixedWingState& state,
            const Controls& controls, const AirMotion& air) {
  return flight(vehicle, environment, state, controls, air).loads;
}

FixedWingVector derivative(const FixedWing& vehicle, const Environment& environment, const FixedWingVector& x,
                           const Controls& controls, const AirMotion& air) {
  const FixedWingState state = state_from_vector(x);
  const Flight f = flight(vehicle, environment, state, controls, air);

  const Vector3d acceleration = f.ecef_from_body * (f.loads.force_body_n / vehicle.mass_kg) + f.here.gravity_ecef_mps2 -
                                2 * f.here.earth_rate_ecef_radps.cross(state.velocity.xyz);
  const Quaterniond turn(0, 0.5 * f.rates_radps.x(), 0.5 * f.rates_radps.y(), 0.5 * f.rates_radps.z());
  const auto servo = [&](double command_rad, double now_rad) {
    const double limit = vehicle.max_deflection_rad;
    return (std::clamp(command_rad, -limit, limit) - now_rad) / vehicle.servo_time_constant_s;
  };

  FixedWingVector change;
  change << state.velocity.xyz, acceleration, (state.ecef_from_body.quaternion * turn).coeffs(),
      angular_acceleration(vehicle, state.body_rates_radps, f.loads.moment_body_nm),
      servo(controls.surfaces.elevator_rad, state.surfaces.elevator_rad),
      servo(controls.surfaces.aileron_rad, state.surfaces.aileron_rad),
      servo(controls.surfaces.rudder_rad, state.surfaces.rudder_rad);
  return change;
}

Result<FixedWingState> advance(const FixedWing& vehicle, const Environment& environment, const FixedWingState& state,
                               const Controls& controls, const AirOverTime& air, double t_s, double dt_s) {
  const auto change = [&](double time_s, const FixedWingVector& x) {
    return derivative(vehicle, environment, x, controls, air.at(time_s));
  };
  FixedWingVector x = rk4_step(change, t_s, to_vector(state), dt_s);
  renormalise_quaternion(x, 6);
  const auto finite = finite_or_error(x, t_s + dt_s);
  if (!finite) return fail(finite);
  return state_from_vector(*finite);
}

}  // namespace nadir::sim

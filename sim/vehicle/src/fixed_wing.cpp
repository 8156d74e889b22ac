#include "nadir/sim/fixed_wing.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "angle.h"
#include "nadir/sim/lag.h"
#include "nadir/sim/step.h"

namespace nadir::sim {
using Eigen::Vector3d;

Surfaces surfaces_after(const FixedWing& vehicle, const Surfaces& from, const Surfaces& command, double duration_s) {
  if (duration_s <= 0) return from;
  const double share = followed_share(vehicle.servo_time_constant_s, duration_s), limit = vehicle.max_deflection_rad;
  const auto moved = [&](double now_rad, double command_rad) {
    return now_rad + share * (std::clamp(command_rad, -limit, limit) - now_rad);
  };
  return {moved(from.elevator_rad, command.elevator_rad), moved(from.aileron_rad, command.aileron_rad),
          moved(from.rudder_rad, command.rudder_rad)};
}

namespace {

/// The exponentials of the blend at an angle of attack; those of another angle take one more, and no more than that.
struct BlendTerms {
  double before = 0, behind = 0;  // stall on the side of positive angles and of negative ones: small while attached

  double stalled() const { return 1 - 1 / ((1 + before) * (1 + behind)); }
  BlendTerms turned(double factor) const { return {before * factor, behind / factor}; }
};

BlendTerms blend_terms(const FixedWing& vehicle, double alpha_rad) {
  const double m = vehicle.stall_sharpness, a0 = vehicle.stall_alpha_rad;
  return {std::exp(m * (alpha_rad - a0)), std::exp(-m * (alpha_rad + a0))};
}

}  // namespace

double stall_blend(const FixedWing& vehicle, double alpha_rad) { return blend_terms(vehicle, alpha_rad).stalled(); }

double ground_effect(const FixedWing& vehicle, double height_m) {
  if (!vehicle.feels_ground || height_m >= ground_effect_spans * vehicle.span_m) return 1;
  const double s = 16 * std::max(height_m, 0.0) / vehicle.span_m;
  return s * s / (1 + s * s);
}

namespace {

/// Coefficients, less what rates, side-slip and surfaces do.
struct AtAlpha {
  double lift = 0, drag = 0, side = 0;
  double roll = 0, pitch = 0, yaw = 0;
};

double attached_lift(const FixedWing& vehicle, double alpha_rad) {
  return vehicle.lift.zero + vehicle.lift.alpha * alpha_rad;
}

/// Normal force of a flat plate, from which lift and drag follow.
double plate_normal(double sin_alpha) { return 2 * sin_alpha * std::abs(sin_alpha); }

double lift_over_stall(const FixedWing& vehicle, double alpha, double sin_alpha, double cos_alpha, double stalled) {
  return (1 - stalled) * attached_lift(vehicle, alpha) + stalled * plate_normal(sin_alpha) * cos_alpha;
}

AtAlpha at_alpha(const FixedWing& vehicle, double alpha, double sin_alpha, double cos_alpha, double stalled,
                 double height_m) {
  const bool airframe = vehicle.stall_model == StallModel::Airframe;
  const double attached = 1 - stalled;
  const double linear_lift = attached_lift(vehicle, alpha), normal = plate_normal(sin_alpha);
  const double induced =
      ground_effect(vehicle, height_m) * linear_lift * linear_lift * vehicle.wing_area_m2 /
      (std::numbers::pi * vehicle.oswald * vehicle.span_m * vehicle.span_m);  // over the aspect ratio
  const double alpha_felt = airframe ? attached * alpha : alpha;
  const auto linear = [&](const Coefficient& c) { return c.zero + c.alpha * alpha_felt; };

  AtAlpha out;
  out.lift = lift_over_stall(vehicle, alpha, sin_alpha, cos_alpha, stalled);
  out.drag = linear(vehicle.drag) + induced;
  out.side = linear(vehicle.side), out.roll = linear(vehicle.roll), out.yaw = linear(vehicle.yaw);
  out.pitch = linear(vehicle.pitch);
  if (!airframe) return out;

  const double aft = 0.25 - 0.175 * (1 - 2 * std::numbers::inv_pi * std::abs(alpha));  // of the wing's quarter chord
  const double attached_pitch = vehicle.pitch.zero + vehicle.pitch.alpha * alpha;
  const double stalled_pitch = vehicle.pitch.zero + vehicle.pitch.alpha * sin_alpha - aft * normal;
  out.drag = linear(vehicle.drag) + attached * induced + stalled * normal * sin_alpha;
  out.pitch = attached * attached_pitch + stalled * stalled_pitch;
  return out;
}

/// Roll damping as the difference in lift between the halves of the wing, each at the angle that its middle meets:
/// times Va, so that nothing is divided by it.
double roll_damping(const FixedWing& vehicle, double alpha, double sin_alpha, double cos_alpha, const BlendTerms& terms,
                    double bp_mps, double airspeed_mps) {
  constexpr double middle = 0.5;  // of half the span
  const double across = middle * bp_mps, along = 2 * airspeed_mps, length = std::sqrt(across * across + along * along);
  if (length == 0) return 0;
  const double per_length = 1 / length;
  const double more = angle_rad(across, along), sin_more = across * per_length, cos_more = along * per_length;
  const double factor = std::exp(vehicle.stall_sharpness * more);
  const double high = lift_over_stall(vehicle, alpha + more, sin_alpha * cos_more + cos_alpha * sin_more,
                                      cos_alpha * cos_more - sin_alpha * sin_more, terms.turned(factor).stalled());
  const double low = lift_over_stall(vehicle, alpha - more, sin_alpha * cos_more - cos_alpha * sin_more,
                                     cos_alpha * cos_more + sin_alpha * sin_more, terms.turned(1 / factor).stalled());
  return vehicle.roll.p * airspeed_mps / (middle * vehicle.lift.alpha) * (high - low);
}

/// Share of what depends on alpha that is left in a side-slip: 1 - sin^4 beta.
double along_share(const AirData& air) {
  if (!(air.airspeed_mps > 0)) return 1;
  const double sine = air.velocity_body_mps.y() / air.airspeed_mps;
  return 1 - sine * sine * sine * sine;
}

}  // namespace

double lift_coefficient(const FixedWing& vehicle, double alpha_rad) {
  return lift_over_stall(vehicle, alpha_rad, std::sin(alpha_rad), std::cos(alpha_rad), stall_blend(vehicle, alpha_rad));
}

GreatestLift greatest_lift(const FixedWing& vehicle) {
  // The lift rises up to somewhere before the stall's middle; the peak is flat, and steps of 1/400 err by 1e-4 of it
  constexpr int steps = 400;
  GreatestLift greatest;
  for (int i = 0; i <= steps; ++i) {
    const double alpha_rad = vehicle.stall_alpha_rad * i / steps, coefficient = lift_coefficient(vehicle, alpha_rad);
    if (coefficient > greatest.coefficient) greatest = {coefficient, alpha_rad};
  }
  return greatest;
}

Loads aerodynamics(const FixedWing& vehicle, const AirData& air, const Vector3d& rates_radps, const Surfaces& surfaces,
                   double density_kgpm3, double height_m) {
  const double va = air.airspeed_mps;
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
  const double sin_alpha = air.sin_alpha, cos_alpha = air.cos_alpha;
  const BlendTerms terms = blend_terms(vehicle, air.alpha_rad);
  AtAlpha c = at_alpha(vehicle, air.alpha_rad, sin_alpha, cos_alpha, terms.stalled(), height_m);
  const bool airframe = vehicle.stall_model == StallModel::Airframe;
  const double along = airframe ? along_share(air) : 1;
  c.side *= along, c.roll *= along, c.yaw *= along;
  const double lift_n = along * newtons(vehicle.lift, c.lift), drag_n = along * newtons(vehicle.drag, c.drag);
  const double pitch_n = along * newtons(vehicle.pitch, c.pitch) + (1 - along) * damping_ns * vehicle.pitch.q * cq;
  double roll_n = newtons(vehicle.roll, c.roll);
  if (airframe)
    roll_n += along * damping_ns *
              (roll_damping(vehicle, air.alpha_rad, sin_alpha, cos_alpha, terms, bp, va) - vehicle.roll.p * bp);

  Loads loads;
  loads.force_body_n = {lift_n * sin_alpha - drag_n * cos_alpha, newtons(vehicle.side, c.side),
                        -lift_n * cos_alpha - drag_n * sin_alpha};
  loads.moment_body_nm = {vehicle.span_m * roll_n, vehicle.chord_m * pitch_n,
                          vehicle.span_m * newtons(vehicle.yaw, c.yaw)};
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

#include "nadir/sim/trim.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using Vector7 = Eigen::Matrix<double, 7, 1>;

/// Unknowns: alpha, roll, pitch, elevator, aileron, rudder, throttle.
struct Problem {
  const FixedWing& vehicle;
  const TrimTarget& target;
  double density_kgpm3, gravity_mps2;

  Vector3d rates(const Vector7& u) const {
    if (target.turn_radius_m == 0) return Vector3d::Zero();
    const double course_rate = target.airspeed_mps * std::cos(target.climb_angle_rad) / target.turn_radius_m;
    return attitude(u).conjugate() * Vector3d(0, 0, course_rate);
  }
  static Eigen::Quaterniond attitude(const Vector7& u) { return geodesy::quaternion_from({0, u[2], u[1]}); }
  static Surfaces surfaces(const Vector7& u) { return {u[3], u[4], u[5]}; }
  Vector3d velocity(const Vector7& u) const {
    return target.airspeed_mps * Vector3d(std::cos(u[0]), 0, std::sin(u[0]));
  }

  Vector7 residual(const Vector7& u) const {
    const Eigen::Quaterniond ned_from_body = attitude(u);
    const Vector3d v = velocity(u), turn = rates(u);
    const Loads l = loads(vehicle, air_data_from(v), turn, surfaces(u), u[6], density_kgpm3);
    const Vector3d gravity = ned_from_body.conjugate() * Vector3d(0, 0, gravity_mps2);
    Vector7 out;
    out << l.force_body_n / vehicle.mass.mass_kg() + gravity - turn.cross(v),
        vehicle.mass.angular_acceleration(turn, l.moment_body_nm),
        (ned_from_body * v).z() + target.airspeed_mps * std::sin(target.climb_angle_rad);
    return out;
  }

  /// Central differences: steps of 1e-6 leave errors of about 1e-9 of the slopes, harmless to Newton's method.
  Eigen::Matrix<double, 7, 7> jacobian(const Vector7& u) const {
    constexpr double step = 1e-6;
    Eigen::Matrix<double, 7, 7> j;
    for (int i = 0; i < 7; ++i) {
      const Vector7 d = step * Vector7::Unit(i);
      j.col(i) = (residual(u + d) - residual(u - d)) / (2 * step);
    }
    return j;
  }
};

std::string describe(const TrimTarget& target) {
  return fmt::format(
      "steady flight at {} m/s, climbing at {:.2f} deg, {}", target.airspeed_mps,
      geodesy::to_degrees(target.climb_angle_rad),
      target.turn_radius_m == 0 ? std::string("straight") : fmt::format("turning at {} m", target.turn_radius_m));
}

// What rounding leaves is 1e-13 of terms around 10; far below that of any measurement is good enough.
constexpr double good_enough = 1e-10;

struct Root {
  Vector7 u;
  double residual = 0;
  bool found() const { return residual < 10 * good_enough; }
};

Root newton(const Problem& problem, Vector7 u) {
  Vector7 left = problem.residual(u);
  for (int iteration = 0; iteration < 50 && left.norm() > good_enough; ++iteration) {
    const Vector7 step = problem.jacobian(u).fullPivLu().solve(left);
    double share = 1;
    while (share > 1e-6 && !(problem.residual(u - share * step).norm() < left.norm())) share /= 2;
    u -= share * step;
    left = problem.residual(u);
  }
  return {u, left.norm()};
}

/// Weight, drag and pitching moment in balance to first order, without the thrust's share of lift.
struct Balance {
  double bank_rad = 0, lift_needed = 0;  // coefficient
  double alpha_rad = 0, elevator_rad = 0, thrust_n = 0, throttle = 0;
};

Balance balance(const Problem& problem) {
  const FixedWing& v = problem.vehicle;
  const TrimTarget& t = problem.target;
  const double va = t.airspeed_mps, weight_n = v.mass.mass_kg() * problem.gravity_mps2;
  const double pressure_n = 0.5 * problem.density_kgpm3 * va * va * v.wing_area_m2;
  const double climb_cos = std::cos(t.climb_angle_rad);
  Balance b;
  b.bank_rad = t.turn_radius_m == 0 ? 0 : std::atan(va * va * climb_cos / (problem.gravity_mps2 * t.turn_radius_m));
  b.lift_needed = weight_n * climb_cos / std::cos(b.bank_rad) / pressure_n;

  const double elevator_lift = v.lift.elevator / v.pitch.elevator;
  const double slope = v.lift.alpha - elevator_lift * v.pitch.alpha;
  const double alpha_rad = (b.lift_needed - v.lift.zero + elevator_lift * v.pitch.zero) / slope;
  const double highest_rad = greatest_lift(v).alpha_rad;
  b.alpha_rad = std::clamp(alpha_rad, -highest_rad, highest_rad);
  b.elevator_rad = -(v.pitch.zero + v.pitch.alpha * b.alpha_rad) / v.pitch.elevator;

  const Vector3d air = va * Vector3d(std::cos(b.alpha_rad), 0, std::sin(b.alpha_rad));
  const Vector3d force =
      aerodynamics(v, air_data_from(air), Vector3d::Zero(), {.elevator_rad = b.elevator_rad}, problem.density_kgpm3)
          .force_body_n;
  b.thrust_n = weight_n * std::sin(t.climb_angle_rad + b.alpha_rad * std::cos(b.bank_rad)) - force.x();
  double low = 0, high = 4;  // of the throttle: thrust rises with it
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    const double thrust_n = propel(v.propulsion, middle, va, problem.density_kgpm3).thrust_n;
    (thrust_n < b.thrust_n ? low : high) = middle;
  }
  b.throttle = high;
  return b;
}

/// A flight as one flies it: upright, on the rising side of the wing's lift.
bool regular(const FixedWing& vehicle, const GreatestLift& greatest, const Vector7& u) {
  const double lowest_rad = -vehicle.stall_alpha_rad;
  return u[0] > lowest_rad && u[0] < greatest.alpha_rad && std::cos(u[1]) > 0 && std::cos(u[2]) > 0 &&
         std::abs(u[1]) < std::numbers::pi && std::abs(u[2]) < std::numbers::pi;
}

/// Why no regular steady flight was found, as far as the balance tells.
std::string reason(const Problem& problem, const Balance& b, double greatest_lift, const Root& last) {
  constexpr double surfaces_take = 0.1;  // share of the greatest lift
  if (b.lift_needed > (1 - surfaces_take) * greatest_lift)
    return fmt::format(
        "none was found before the stall: it needs a lift coefficient of {:.2f} where the wing gives at "
        "most {:.2f}, less what the elevator takes",
        b.lift_needed, greatest_lift);
  const double idle_n =
      propel(problem.vehicle.propulsion, 0, problem.target.airspeed_mps, problem.density_kgpm3).thrust_n;
  if (b.thrust_n < idle_n)
    return fmt::format("none was found: it needs a thrust of {:.1f} N where an idle throttle gives {:.1f} N: too steep",
                       b.thrust_n, idle_n);
  if (last.found())
    return fmt::format(
        "the only one found is at an angle of attack of {:.1f} deg and a roll of {:.1f} deg, beyond the "
        "stall or inverted",
        geodesy::to_degrees(last.u[0]), geodesy::to_degrees(last.u[1]));
  if (!std::isfinite(last.residual)) return "none was found; the vehicle has no motion near it";
  return fmt::format("none was found; an acceleration of {:.3g} m/s^2 is left", last.residual);
}

}  // namespace

Result<Trim> trim(const FixedWing& vehicle, const TrimTarget& target, double density_kgpm3, double gravity_mps2,
                  const std::optional<TrimGuess>& guess) {
  if (!(target.airspeed_mps > 0))
    return fail(Error::Kind::Unsupported, describe(target) + ": an airspeed above zero is needed");
  const Problem problem{vehicle, target, density_kgpm3, gravity_mps2};
  const GreatestLift greatest = greatest_lift(vehicle);

  Root root{Vector7::Zero(), std::numeric_limits<double>::infinity()};
  const auto good = [&] { return root.found() && regular(vehicle, greatest, root.u); };
  if (guess) {
    const Surfaces& s = guess->controls.surfaces;
    Vector7 u;
    u << guess->alpha_rad, guess->roll_rad, guess->pitch_rad, s.elevator_rad, s.aileron_rad, s.rudder_rad,
        guess->controls.throttle;
    root = newton(problem, u);
  }
  if (!good()) {
    const Balance b = balance(problem);
    Vector7 u;
    u << b.alpha_rad, b.bank_rad, target.climb_angle_rad + b.alpha_rad * std::cos(b.bank_rad), b.elevator_rad, 0, 0,
        b.throttle;
    root = newton(problem, u);
    if (!good())
      return fail(Error::Kind::NotFound,
                  fmt::format("{}: {}", describe(target), reason(problem, b, greatest.coefficient, root)));
  }
  const Vector7& u = root.u;

  Trim found;
  found.target = target;
  found.alpha_rad = u[0];
  found.roll_rad = u[1];
  found.pitch_rad = u[2];
  found.rates_radps = problem.rates(u);
  found.controls = {Problem::surfaces(u), u[6]};
  found.propeller = propel(vehicle.propulsion, u[6], target.airspeed_mps, density_kgpm3);
  found.residual = root.residual;

  // Solved without limits, so that a failure can say how far off it is.
  if (u[6] < 0 || u[6] > 1)
    return fail(Error::Kind::NotFound,
                fmt::format("{}: needs a throttle of {:.3f} where 0 to 1 is all there is", describe(target), u[6]));
  const char* const names[] = {"elevator", "aileron", "rudder"};
  for (int i = 0; i < 3; ++i)
    if (std::abs(u[3 + i]) > vehicle.max_deflection_rad)
      return fail(Error::Kind::NotFound, fmt::format("{}: needs {:.1f} deg of {} where {:.1f} is all there is",
                                                     describe(target), geodesy::to_degrees(u[3 + i]), names[i],
                                                     geodesy::to_degrees(vehicle.max_deflection_rad)));
  return found;
}

double stall_speed_mps(const FixedWing& vehicle, double density_kgpm3, double gravity_mps2) {
  return std::sqrt(2 * vehicle.mass.mass_kg() * gravity_mps2 /
                   (density_kgpm3 * vehicle.wing_area_m2 * greatest_lift(vehicle).coefficient));
}

Result<Trim> trim(const FixedWing& vehicle, const TrimTarget& target, const Environment& environment,
                  const geodesy::Geodetic& place) {
  const Surroundings here = environment.at(geodesy::ecef_from_geodetic(place));
  return trim(vehicle, target, here.density_kgpm3, here.gravity_ecef_mps2.norm());
}

FixedWingState trimmed_state(const Trim& trim, const Environment& environment, const geodesy::Geodetic& place,
                             double yaw_rad, const Vector3d& wind_ned_mps) {
  FixedWingState state;
  state.position = geodesy::ecef_from_geodetic(place);
  const Surroundings here = environment.at(state.position);
  const Eigen::Quaterniond ecef_from_ned(here.ecef_from_ned);
  const Eigen::Quaterniond ned_from_body = geodesy::quaternion_from({yaw_rad, trim.pitch_rad, trim.roll_rad});
  state.ecef_from_body.quaternion = (ecef_from_ned * ned_from_body).normalized();
  const double va = trim.target.airspeed_mps;
  const Vector3d air_body(va * std::cos(trim.alpha_rad), 0, va * std::sin(trim.alpha_rad));
  state.velocity.xyz = state.ecef_from_body.quaternion * air_body + here.ecef_from_ned * wind_ned_mps;
  state.body_rates_radps = trim.rates_radps + state.ecef_from_body.quaternion.conjugate() * here.earth_rate_ecef_radps;
  state.surfaces = trim.controls.surfaces;
  return state;
}

}  // namespace nadir::sim

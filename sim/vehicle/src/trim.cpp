#include "nadir/sim/trim.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

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

}  // namespace

Result<Trim> trim(const FixedWing& vehicle, const TrimTarget& target, double density_kgpm3, double gravity_mps2) {
  if (!(target.airspeed_mps > 0))
    return fail(Error::Kind::Unsupported, describe(target) + ": an airspeed above zero is needed");

  // Start from the bank of a coordinated turn, small angles and half throttle.
  const Problem problem{vehicle, target, density_kgpm3, gravity_mps2};
  const double alpha = 0.05;
  const double bank =
      target.turn_radius_m == 0
          ? 0
          : std::atan(target.airspeed_mps * target.airspeed_mps / (gravity_mps2 * target.turn_radius_m));
  Vector7 u;
  u << alpha, bank, target.climb_angle_rad + alpha * std::cos(bank), 0, 0, 0, 0.5;

  // What rounding leaves is 1e-13 of terms around 10; far below that of any measurement is good enough.
  constexpr double good_enough = 1e-10;
  Vector7 left = problem.residual(u);
  for (int iteration = 0; iteration < 50 && left.norm() > good_enough; ++iteration) {
    const Vector7 step = problem.jacobian(u).fullPivLu().solve(left);
    double share = 1;
    while (share > 1e-6 && !(problem.residual(u - share * step).norm() < left.norm())) share /= 2;
    u -= share * step;
    left = problem.residual(u);
  }
  if (!(left.norm() < 10 * good_enough))
    return fail(
        Error::Kind::NotFound,
        std::isfinite(left.norm())
            ? fmt::format("{}: none was found; an acceleration of {:.3g} m/s^2 is left", describe(target), left.norm())
            : fmt::format("{}: none was found; the vehicle has no motion near it", describe(target)));

  Trim found;
  found.target = target;
  found.alpha_rad = u[0];
  found.roll_rad = u[1];
  found.pitch_rad = u[2];
  found.rates_radps = problem.rates(u);
  found.controls = {Problem::surfaces(u), u[6]};
  found.propeller = propel(vehicle.propulsion, u[6], target.airspeed_mps, density_kgpm3);
  found.residual = left.norm();

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

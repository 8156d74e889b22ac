#include "nadir/sim/rigid_body.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <string>
#include <vector>

#include "angle.h"

namespace nadir::sim {
using Eigen::Matrix3d, Eigen::Quaterniond, Eigen::Vector3d;

Result<MassProperties> MassProperties::create(double mass_kg, const Inertia& j) {
  std::vector<std::string> faults;
  if (!(mass_kg > 0) || !std::isfinite(mass_kg))
    faults.push_back(fmt::format("mass: expected more than 0 kg, found {}", mass_kg));
  MassProperties made;
  made.mass_kg_ = mass_kg;
  made.inertia_ << j.jxx_kgm2, -j.jxy_kgm2, -j.jxz_kgm2,  //
      -j.jxy_kgm2, j.jyy_kgm2, -j.jyz_kgm2,               //
      -j.jxz_kgm2, -j.jyz_kgm2, j.jzz_kgm2;
  if (!made.inertia_.allFinite()) {
    faults.push_back("inertia: expected finite numbers");
  } else {
    const Vector3d moments =
        Eigen::SelfAdjointEigenSolver<Matrix3d>(made.inertia_, Eigen::EigenvaluesOnly).eigenvalues();
    // Flat plates have equality, up to rounding.
    if (!(moments[0] > 0))
      faults.push_back(fmt::format("inertia: expected positive principal moments, found {:.4g} kg m^2", moments[0]));
    else if (moments[2] > (moments[0] + moments[1]) * (1 + 1e-9))
      faults.push_back(fmt::format(
          "inertia: no body has principal moments of {:.4g}, {:.4g} and {:.4g} kg m^2, of which one exceeds "
          "the sum of the others",
          moments[0], moments[1], moments[2]));
  }
  if (!faults.empty()) return fail(Error::Kind::Malformed, fmt::format("{}", fmt::join(faults, "; ")));
  made.inverse_ = made.inertia_.inverse();
  return made;
}

Vector3d MassProperties::angular_acceleration(const Vector3d& rates_radps, const Vector3d& moment_nm) const {
  const Vector3d momentum = inertia_ * rates_radps;
  return inverse_ * (moment_nm - rates_radps.cross(momentum));
}

BodyVector to_vector(const BodyState& state) {
  BodyVector x;
  x << state.position.xyz, state.velocity.xyz, state.ecef_from_body.quaternion.coeffs(), state.body_rates_radps;
  return x;
}

BodyState body_state_from_vector(const BodyVector& x) {
  BodyState state;
  state.position.xyz = x.segment<3>(0);
  state.velocity.xyz = x.segment<3>(3);
  state.ecef_from_body.quaternion.coeffs() = x.segment<4>(body_quaternion_at);
  state.body_rates_radps = x.segment<3>(10);
  return state;
}

AirData air_data_from(const Vector3d& velocity_body_mps) {
  const Vector3d& v = velocity_body_mps;
  const double in_plane = std::sqrt(v.x() * v.x() + v.z() * v.z());
  AirData air{.velocity_body_mps = v,
              .airspeed_mps = v.norm(),
              .alpha_rad = angle_rad(v.z(), v.x()),
              .beta_rad = angle_rad(v.y(), in_plane)};
  if (in_plane > 0) {
    const double per_speed = 1 / in_plane;
    air.sin_alpha = v.z() * per_speed;
    air.cos_alpha = v.x() * per_speed;
  }
  return air;
}

BodyInAir body_in_air(const BodyState& state, const Environment& environment, const AirMotion& air) {
  BodyInAir in_air;
  in_air.here = environment.at(state.position);
  in_air.ecef_from_body = state.ecef_from_body.quaternion.toRotationMatrix();
  const Matrix3d body_from_ecef = in_air.ecef_from_body.transpose();
  in_air.rates_radps = state.body_rates_radps - body_from_ecef * in_air.here.earth_rate_ecef_radps;
  in_air.rates_against_air_radps =
      in_air.rates_radps - body_from_ecef * (in_air.here.ecef_from_ned * air.rates_ned_radps);
  in_air.flow = air_data_from(body_from_ecef * (state.velocity.xyz - in_air.here.ecef_from_ned * air.velocity_ned_mps));
  return in_air;
}

BodyVector body_derivative(const MassProperties& mass, const BodyState& state, const BodyInAir& in_air,
                           const Loads& loads) {
  const Vector3d acceleration = in_air.ecef_from_body * (loads.force_body_n / mass.mass_kg()) +
                                in_air.here.gravity_ecef_mps2 -
                                2 * in_air.here.earth_rate_ecef_radps.cross(state.velocity.xyz);
  const Vector3d& turning = in_air.rates_radps;
  const Quaterniond half_turn(0, 0.5 * turning.x(), 0.5 * turning.y(), 0.5 * turning.z());
  BodyVector change;
  change << state.velocity.xyz, acceleration, (state.ecef_from_body.quaternion * half_turn).coeffs(),
      mass.angular_acceleration(state.body_rates_radps, loads.moment_body_nm);
  return change;
}

}  // namespace nadir::sim

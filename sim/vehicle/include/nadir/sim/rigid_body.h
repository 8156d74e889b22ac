#pragma once

#include <Eigen/Core>
#include <limits>

#include "nadir/base/result.h"
#include "nadir/geodesy/frames.h"
#include "nadir/sim/air_motion.h"
#include "nadir/sim/environment.h"

namespace nadir::sim {

/// About the centre of mass, along body axes. Products are positive as integrals (of x z dm): the matrix has -jxz.
struct Inertia {
  double jxx_kgm2 = 0, jyy_kgm2 = 0, jzz_kgm2 = 0;
  double jxy_kgm2 = 0, jxz_kgm2 = 0, jyz_kgm2 = 0;
};

/// Mass and inertia that a body can have.
class MassProperties {
 public:
  /// Fails unless mass is positive, and inertia that of some distribution of mass: positive principal moments of which
  /// none exceeds the sum of the other two. The message lists all that is wrong.
  static Result<MassProperties> create(double mass_kg, const Inertia& inertia);
  /// A kilogram with moments of 1 kg m^2.
  MassProperties() = default;

  double mass_kg() const { return mass_kg_; }
  const Eigen::Matrix3d& inertia_kgm2() const { return inertia_; }

  /// Angular acceleration, rad/s^2, of a body that turns at `rates_radps` under a moment about its centre of mass.
  Eigen::Vector3d angular_acceleration(const Eigen::Vector3d& rates_radps, const Eigen::Vector3d& moment_nm) const;

 private:
  double mass_kg_ = 1;
  Eigen::Matrix3d inertia_ = Eigen::Matrix3d::Identity(), inverse_ = Eigen::Matrix3d::Identity();
};

/// Force and moment along body axes, about the centre of mass, without gravity: force over mass is what accelerometers
/// feel.
struct Loads {
  Eigen::Vector3d force_body_n = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment_body_nm = Eigen::Vector3d::Zero();
};
inline Loads operator+(const Loads& a, const Loads& b) {
  return {a.force_body_n + b.force_body_n, a.moment_body_nm + b.moment_body_nm};
}

/// Where a body is and how it moves.
struct BodyState {
  geodesy::Point<geodesy::frame::Ecef> position{Eigen::Vector3d::Zero()};      // of the centre of mass
  geodesy::Direction<geodesy::frame::Ecef> velocity{Eigen::Vector3d::Zero()};  // against the ground, m/s
  geodesy::Rotation<geodesy::frame::Ecef, geodesy::frame::Body> ecef_from_body;
  Eigen::Vector3d body_rates_radps =
      Eigen::Vector3d::Zero();  // against inertial space, along body axes: what gyros feel
};

/// The same as numbers for an integrator: position 0-2, velocity 3-5, quaternion x y z w 6-9, rates 10-12. Vehicles
/// append what else they integrate.
using BodyVector = Eigen::Matrix<double, 13, 1>;
constexpr Eigen::Index body_quaternion_at = 6;
BodyVector to_vector(const BodyState& state);
BodyState body_state_from_vector(const BodyVector& x);

/// The air as it meets a body. All zero in still air at rest.
struct AirData {
  Eigen::Vector3d velocity_body_mps = Eigen::Vector3d::Zero();  // of the body against the air
  double airspeed_mps = 0;
  double alpha_rad = 0;  // angle of attack, (-pi, pi]
  double sin_alpha = 0, cos_alpha = 1;
  double beta_rad = 0;  // side-slip, positive with the air from the right
};
AirData air_data_from(const Eigen::Vector3d& velocity_body_mps);

/// A body's state in the terms that forces depend on.
struct BodyInAir {
  Surroundings here;
  Eigen::Matrix3d ecef_from_body;
  Eigen::Vector3d rates_radps;              // against the ground
  Eigen::Vector3d rates_against_air_radps;  // as the air turns itself
  AirData flow;
};
BodyInAir body_in_air(const BodyState& state, const Environment& environment, const AirMotion& air);

/// Height of a body that no ground is near.
inline constexpr double no_ground_m = std::numeric_limits<double>::infinity();

/// Change of the state with time under `loads` and gravity, over an Earth that turns.
BodyVector body_derivative(const MassProperties& mass, const BodyState& state, const BodyInAir& in_air,
                           const Loads& loads);

}  // namespace nadir::sim

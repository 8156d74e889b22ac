#include "nadir/sim/multirotor_trim.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {

using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// The vehicle with nothing that takes time.
Multirotor without_dynamics(Multirotor vehicle) {
  for (Rotor& rotor : vehicle.rotors) {
    rotor.rise_time_constant_s = rotor.fall_time_constant_s = 0;
    if (auto* electric = std::get_if<ElectricDrive>(&rotor.drive)) electric->dynamics = {};
  }
  return vehicle;
}

/// Torque of a pulse drive at a thrust, beyond its limits too.
double torque_at(const Rotor& rotor, double thrust_n) {
  const auto& torque = std::get<PulseDrive>(rotor.drive).torque_nm;
  const double pulse_us = 1000 + 1000 * throttle_for_thrust(rotor, thrust_n, 0, 0);
  return (torque[0] * pulse_us + torque[1]) * pulse_us + torque[2];
}

/// Unknowns: roll, pitch, and thrust, roll, pitch and yaw as shares of the weight and of weight times a metre. Rotors
/// answer without limits, so that a failure can say how far off it is.
class Problem {
 public:
  Problem(const Multirotor& vehicle, const Mixer& mixer, const MultirotorTrimTarget& target, double density,
          double gravity, double charge_ah)
      : vehicle_(without_dynamics(vehicle)), target_(target), gravity_(gravity) {
    in_air_.here.density_kgpm3 = density;
    in_air_.here.ecef_from_ned.setIdentity();
    in_air_.here.gravity_ecef_mps2 = {0, 0, gravity};
    in_air_.here.earth_rate_ecef_radps.setZero();
    in_air_.rates_radps = in_air_.rates_against_air_radps = Vector3d::Zero();
    state_.charge_ah = charge_ah;
    const double weight_n = vehicle.mass.mass_kg() * gravity;
    if (vehicle.lumped) {
      basis_ = weight_n * Eigen::Matrix4d::Identity();
      return;
    }
    const auto n = static_cast<Eigen::Index>(vehicle.rotors.size());
    basis_.resize(n, 4);
    for (Eigen::Index k = 0; k < 4; ++k) basis_.col(k) = weight_n * mixer.thrusts().col(k);
    if (!electric()) return;
    const double voltage = vehicle.battery ? open_circuit_v(*vehicle.battery, charge_ah) : 0;
    for (Eigen::Index i = 0; i < n; ++i) {  // about in proportion to what hover takes
      const double hover_n = basis_(i, 0);
      basis_.row(i) *= throttle_for_thrust(rotor(i), hover_n, 0, density, voltage) / hover_n;
    }
  }

  Vector6 residual(const Vector6& u) {
    evaluate(u);
    Vector6 left;
    left << output_.loads.force_body_n / vehicle_.mass.mass_kg() +
                in_air_.ecef_from_body.transpose() * Vector3d(0, 0, gravity_),
        vehicle_.mass.angular_acceleration(Vector3d::Zero(), output_.loads.moment_body_nm);
    return left;
  }

  /// Central differences: steps of 1e-6 leave errors of about 1e-9 of the slopes, harmless to Newton's method.
  Eigen::Matrix<double, 6, 6> jacobian(const Vector6& u) {
    constexpr double step = 1e-6;
    Eigen::Matrix<double, 6, 6> j;
    for (int i = 0; i < 6; ++i) {
      const Vector6 d = step * Vector6::Unit(i);
      j.col(i) = (residual(u + d) - residual(u - d)) / (2 * step);
    }
    return j;
  }

  const MultirotorOutput& output() const { return output_; }
  /// Controls of the last evaluation, without limits.
  RotorValues controls() const {
    RotorValues out = state_.followed;
    for (Eigen::Index i = 0; i < out.size(); ++i) {
      if (vehicle_.lumped)
        out[i] /= i == 0 ? vehicle_.lumped->max_thrust_n : vehicle_.lumped->max_moment_nm[i - 1];
      else if (!electric())
        out[i] = throttle_for_thrust(rotor(i), out[i], 0, 0);
    }
    return out;
  }
  /// What a control is, and its lower limit.
  std::string name(Eigen::Index i) const {
    if (!vehicle_.lumped) return fmt::format("a throttle of rotor {}", i + 1);
    return i == 0 ? "a share of thrust" : fmt::format("a share of the moment about {}", "xyz"[i - 1]);
  }
  double lower_limit(Eigen::Index i) const { return vehicle_.lumped && i > 0 ? -1 : 0; }

 private:
  bool electric() const {
    return !vehicle_.rotors.empty() && std::holds_alternative<ElectricDrive>(vehicle_.rotors.front().drive);
  }
  const Rotor& rotor(Eigen::Index i) const { return vehicle_.rotors[static_cast<std::size_t>(i)]; }

  void evaluate(const Vector6& u) {
    in_air_.ecef_from_body = geodesy::quaternion_from({0, u[1], u[0]}).toRotationMatrix();
    in_air_.flow = air_data_from(in_air_.ecef_from_body.transpose() *
                                 Vector3d(target_.forward_mps, target_.right_mps, -target_.climb_mps));
    state_.followed = (basis_ * u.tail<4>()).array();
    if (!vehicle_.lumped && !electric()) {
      state_.followed_torque_nm.resize(state_.followed.size());
      for (Eigen::Index i = 0; i < state_.followed.size(); ++i)
        state_.followed_torque_nm[i] = torque_at(rotor(i), state_.followed[i]);
    }
    output_ = sim::output(vehicle_, in_air_, state_, {}, no_ground_m, CurrentModel::Settled);
  }

  Multirotor vehicle_;
  MultirotorTrimTarget target_;
  double gravity_;
  Eigen::Matrix<double, Eigen::Dynamic, 4> basis_;  // what stands behind lags, of the unknowns
  BodyInAir in_air_;
  MultirotorState state_;
  MultirotorOutput output_;
};

constexpr double good_enough = 1e-10;  // rounding leaves 1e-13 of terms around 10

/// Newton's method; the length of what is left.
double solve(Problem& problem, Vector6& u) {
  Vector6 left = problem.residual(u);
  for (int iteration = 0; iteration < 60 && left.norm() > good_enough; ++iteration) {
    const Vector6 step = problem.jacobian(u).fullPivLu().solve(left);
    double share = 1;
    while (share > 1e-6 && !(problem.residual(u - share * step).norm() < left.norm())) share /= 2;
    u -= share * step;
    left = problem.residual(u);
  }
  return left.norm();
}

std::string describe(const MultirotorTrimTarget& t) {
  return fmt::format("steady flight at {} m/s forward, {} m/s to the right, {} m/s up", t.forward_mps, t.right_mps,
                     t.climb_mps);
}

}  // namespace

Result<MultirotorTrim> trim(const Multirotor& vehicle, const MultirotorTrimTarget& target, double density_kgpm3,
                            double gravity_mps2, double charge_ah, const MultirotorTrimStart& start) {
  if (!std::isfinite(target.forward_mps + target.right_mps + target.climb_mps))
    return fail(Error::Kind::Malformed, describe(target) + ": expected finite speeds");
  if (vehicle.battery && !(charge_ah > 0))
    return fail(Error::Kind::NotFound, describe(target) + ": the battery is empty");
  const auto mixer = Mixer::create(vehicle, density_kgpm3);
  if (!mixer) return fail(mixer);

  Problem problem(vehicle, *mixer, target, density_kgpm3, gravity_mps2, charge_ah);
  Vector6 u;
  u << start.roll_rad, start.pitch_rad, start.thrust_share, 0, 0, 0;
  double left = solve(problem, u);
  const auto upright = [&] { return std::cos(u[0]) > 0 && std::cos(u[1]) > 0; };
  if (!(left < 10 * good_enough) || !upright()) {
    u << 0, 0, 1, 0, 0, 0;
    left = solve(problem, u);
  }
  if (!(left < 10 * good_enough) || !upright())
    return fail(Error::Kind::NotFound,
                std::isfinite(left)
                    ? fmt::format("{}: none was found; an acceleration of {:.3g} m/s^2 is left", describe(target), left)
                    : fmt::format("{}: none was found; the vehicle has no motion near it", describe(target)));

  MultirotorTrim found;
  found.target = target;
  found.roll_rad = std::remainder(u[0], 2 * std::numbers::pi);
  found.pitch_rad = std::remainder(u[1], 2 * std::numbers::pi);
  found.controls.actuators = problem.controls();
  found.output = problem.output();
  found.residual = left;
  for (Eigen::Index i = 0; i < found.controls.actuators.size(); ++i)
    if (const double value = found.controls.actuators[i]; !(value >= problem.lower_limit(i) && value <= 1))
      return fail(Error::Kind::NotFound, fmt::format("{}: needs {} of {:.3f} where {:.0f} to 1 is all there is",
                                                     describe(target), problem.name(i), value, problem.lower_limit(i)));
  return found;
}

void settle(const Multirotor& vehicle, const Environment& environment, const MultirotorControls& controls,
            const AirMotion& air, MultirotorState& state) {
  const auto n = static_cast<Eigen::Index>(vehicle.rotors.size());
  state.followed = state.followed_torque_nm = state.omega_radps = state.current_a = RotorValues();
  bool lags = vehicle.lumped.has_value();
  for (const Rotor& rotor : vehicle.rotors)
    lags = lags || rotor.rise_time_constant_s > 0 || rotor.fall_time_constant_s > 0;
  const auto* drive = n > 0 ? std::get_if<ElectricDrive>(&vehicle.rotors.front().drive) : nullptr;
  if (lags) {
    state.followed = RotorValues::Zero(actuator_count(vehicle));
    if (n > 0 && !drive) state.followed_torque_nm = RotorValues::Zero(n);
    follow_for(vehicle, controls, 1e9, state);  // as good as for ever
  }
  if (!drive || drive->dynamics.rotor_inertia_kgm2 == 0) return;
  const MultirotorOutput settled = output(without_dynamics(vehicle), environment, state, controls, air);
  state.omega_radps = settled.omega_radps;
  if (drive->dynamics.inductance_h > 0) state.current_a = settled.current_a;
}

MultirotorState trimmed_state(const Multirotor& vehicle, const MultirotorTrim& trim, const Environment& environment,
                              const geodesy::Geodetic& place, double yaw_rad, const Vector3d& wind_ned_mps,
                              double charge_ah) {
  MultirotorState state;
  state.position = geodesy::ecef_from_geodetic(place);
  const Surroundings here = environment.at(state.position);
  const Eigen::Quaterniond ned_from_body = geodesy::quaternion_from({yaw_rad, trim.pitch_rad, trim.roll_rad});
  state.ecef_from_body.quaternion = (Eigen::Quaterniond(here.ecef_from_ned) * ned_from_body).normalized();
  const MultirotorTrimTarget& t = trim.target;
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  const Vector3d air_ned(c * t.forward_mps - s * t.right_mps, s * t.forward_mps + c * t.right_mps, -t.climb_mps);
  state.velocity.xyz = here.ecef_from_ned * (air_ned + wind_ned_mps);
  state.body_rates_radps = state.ecef_from_body.quaternion.conjugate() * here.earth_rate_ecef_radps;
  state.charge_ah = charge_ah;
  settle(vehicle, environment, trim.controls, wind_ned_mps, state);
  return state;
}

}  // namespace nadir::sim

#include "nadir/sim/multirotor_control.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "nadir/sim/lag.h"

namespace nadir::sim {
namespace {

using Eigen::Quaterniond, Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

/// How much slower each loop is than the one inside it.
constexpr double tilt_ratio = 3, velocity_ratio = 3, position_ratio = 3;

/// `gain` times an error, but no faster than `acceleration` brakes: beyond acceleration/gain^2 as its square root.
double braked(double error, double gain, double acceleration) {
  const double linear = acceleration / (gain * gain), size = std::abs(error);
  if (size <= linear) return gain * error;
  return std::copysign(std::sqrt(acceleration * (2 * size - linear)), error);
}

Vector3d braked(const Vector3d& error, double gain, double acceleration) {
  const double size = error.norm();
  return size > 0 ? Vector3d(braked(size, gain, acceleration) / size * error) : Vector3d::Zero();
}

Vector3d shortened(const Vector3d& v, double length) {
  const double size = v.norm();
  return size > length ? Vector3d(length / size * v) : v;
}

Vector3d velocity_ned(const Navigation& now) {
  return {now.ground_speed_mps * std::cos(now.course_rad), now.ground_speed_mps * std::sin(now.course_rad),
          -now.climb_rate_mps};
}

/// The attitude whose thrust axis points along `thrust_ned`, with the nose as near to `yaw_rad` as that allows.
Quaterniond attitude_for(const Vector3d& thrust_ned, double yaw_rad, const Vector3d& thrust_axis) {
  const Vector3d down = -thrust_ned.normalized();
  const Vector3d nose(std::cos(yaw_rad), std::sin(yaw_rad), 0);
  const Vector3d right = down.cross(nose).normalized();
  Eigen::Matrix3d ned_from_level;
  ned_from_level << right.cross(down), right, down;
  return Quaterniond(ned_from_level) * Quaterniond::FromTwoVectors(thrust_axis, -Vector3d::UnitZ());
}

double total_lag_s(const Mixer& mixer, double lead_s, double period_s) {
  const double rotors_s = lead_s > 0 ? std::min(lead_s, mixer.slowest_lag_s()) : mixer.slowest_lag_s();
  return rotors_s + 1.5 * period_s;
}

bool leads(const Multirotor& vehicle) {
  if (vehicle.lumped) return true;
  return std::any_of(vehicle.rotors.begin(), vehicle.rotors.end(), [](const Rotor& rotor) {
    return rotor.rise_time_constant_s > 0 || rotor.fall_time_constant_s > 0;
  });
}

}  // namespace

Result<MultirotorGains> multirotor_gains(const Multirotor& vehicle, double period_s, double density_kgpm3,
                                         double gravity_mps2) {
  const auto mixer = Mixer::create(vehicle, density_kgpm3);
  if (!mixer) return fail(mixer);
  const double weight_n = vehicle.mass.mass_kg() * gravity_mps2;
  if (!(mixer->max_thrust_n() > 1.2 * weight_n))
    return fail(Error::Kind::Unsupported,
                fmt::format("multirotor: a greatest thrust of {:.1f} N against a weight of {:.1f} N leaves nothing to "
                            "steer with: expected 1.2 times the weight at least",
                            mixer->max_thrust_n(), weight_n));
  MultirotorGains gains;
  // A lag shortened to a quarter takes four times the change of thrust
  if (leads(vehicle)) gains.lead_s = std::max(2 * period_s, mixer->slowest_lag_s() / 4);
  const double lag_s = total_lag_s(*mixer, gains.lead_s, period_s);
  gains.rate_per_s = std::min(25.0, 1 / (2 * lag_s));  // s^2 lag + s + gain: damping 0.7
  gains.tilt_per_s = gains.rate_per_s / tilt_ratio;
  gains.yaw_per_s = gains.tilt_per_s / 2;
  gains.rate_integral_per_s2 = gains.rate_per_s * gains.tilt_per_s / 4;
  gains.velocity_per_s = gains.tilt_per_s / velocity_ratio;
  gains.disturbance_per_s = gains.velocity_per_s;
  gains.position_per_s = gains.velocity_per_s / position_ratio;

  const Vector3d moment = mixer->max_moment_nm(weight_n);
  const auto& inertia = vehicle.mass.inertia_kgm2();
  gains.max_tilt_acceleration_radps2 = 0.5 * std::min(moment.x() / inertia(0, 0), moment.y() / inertia(1, 1));
  gains.max_yaw_acceleration_radps2 = 0.5 * moment.z() / inertia(2, 2);
  // Thrust that carries the vehicle in its steepest attitude, and a tenth to steer with
  gains.max_tilt_rad = std::min(gains.max_tilt_rad, std::acos(std::min(1.0, 1.1 * weight_n / mixer->max_thrust_n())));
  return gains;
}

Result<void> check(const MultirotorGains& gains, const Mixer& mixer, double period_s, double gravity_mps2) {
  for (const double gain : {gains.rate_per_s, gains.tilt_per_s, gains.yaw_per_s, gains.velocity_per_s,
                            gains.position_per_s, gains.disturbance_per_s})
    if (!(gain > 0) || !std::isfinite(gain))
      return fail(Error::Kind::Malformed, fmt::format("multirotor gains: expected gains above 0, found {}", gain));
  // One axis: position, velocity, angle (m/s^2 of it), rate, angular acceleration behind the lag, integral of the rate,
  // disturbance and the velocity that its observer expects
  const double lag = total_lag_s(mixer, gains.lead_s, period_s), d = gains.disturbance_per_s;
  Eigen::Matrix<double, 8, 8> a = Eigen::Matrix<double, 8, 8>::Zero();
  a(0, 1) = 1;
  a(1, 2) = gravity_mps2;
  a(2, 3) = 1;
  a(3, 4) = 1;
  Eigen::Matrix<double, 1, 8> angle, rate, asked;
  angle << -gains.velocity_per_s * gains.position_per_s, -gains.velocity_per_s, 0, 0, 0, 0, -1, 0;
  angle /= gravity_mps2;
  rate = gains.tilt_per_s * angle;
  rate(2) -= gains.tilt_per_s;
  rate(3) -= 1;  // the error of the rate
  asked = gains.rate_per_s * rate;
  asked(5) += gains.rate_integral_per_s2;
  a.row(4) = asked / lag;
  a(4, 4) -= 1 / lag;
  a.row(5) = rate;
  a(6, 1) = d * d;
  a(6, 7) = -d * d;
  a(7, 1) = 2 * d;
  a(7, 7) = -2 * d;
  a(7, 2) = gravity_mps2;
  a(7, 6) = 1;
  const auto eigenvalues = Eigen::EigenSolver<Eigen::Matrix<double, 8, 8>>(a, false).eigenvalues();
  const double growth = eigenvalues.real().maxCoeff();
  if (!(growth < 0))
    return fail(Error::Kind::Unsupported,
                fmt::format("multirotor gains: the loops are not stable: with a lag of {:.3g} s errors grow e-fold in "
                            "{:.3g} s; gains of outer loops or of the rate are to be lower",
                            lag, 1 / std::max(growth, 1e-9)));
  return {};
}

MultirotorControl::MultirotorControl(const Multirotor& vehicle, Mixer mixer, const MultirotorGains& gains,
                                     double gravity_mps2)
    : vehicle_(vehicle), mixer_(std::move(mixer)), gains_(gains), gravity_mps2_(gravity_mps2) {}

void MultirotorControl::reset(const MultirotorState& state, const Navigation& now) {
  model_.followed = state.followed;
  model_.followed_torque_nm = state.followed_torque_nm;
  rate_integral_radps2_.setZero();
  yaw_drag_nm_ = 0;
  learning_ = false;
  // The thrust that carries it, and where that points beside upwards
  const Vector3d up = geodesy::quaternion_from(now.attitude) * mixer_.thrust_axis();
  told_acceleration_mps2_ = Vector3d::Zero();
  if (up.z() < -0.1) told_acceleration_mps2_.head<2>() = gravity_mps2_ / -up.z() * up.head<2>();
  disturbance_mps2_ = -told_acceleration_mps2_;
}

void MultirotorControl::learn(const Vector3d& velocity, double dt_s) {
  if (!learning_) {
    expected_velocity_mps_ = velocity;
    learning_ = true;
    return;
  }
  // An observer with both rates at `disturbance_per_s`, exact for that: both correct what is left of the last step
  const double kept = std::exp(-gains_.disturbance_per_s * dt_s);
  expected_velocity_mps_ += dt_s * (told_acceleration_mps2_ + disturbance_mps2_);
  const Vector3d off = velocity - expected_velocity_mps_;
  expected_velocity_mps_ += (1 - kept * kept) * off;
  disturbance_mps2_ += (1 - kept) * (1 - kept) / dt_s * off;
  disturbance_mps2_ = shortened(disturbance_mps2_, gravity_mps2_);  // more is a fall, not a wind
}

Vector3d MultirotorControl::acceleration_command(const MultirotorSetpoint& setpoint, const Navigation& now) const {
  const Vector3d position(now.north_m, now.east_m, -now.height_m);
  const Vector3d off = setpoint.position_ned_m - position;
  const double level_mps2 = 0.5 * gravity_mps2_ * std::tan(gains_.max_tilt_rad);
  Vector3d velocity = setpoint.velocity_ned_mps;
  velocity.head<2>() += braked(Vector3d(off.x(), off.y(), 0), gains_.position_per_s, level_mps2).head<2>();
  velocity.z() += braked(off.z(), gains_.position_per_s, 0.3 * gravity_mps2_);
  velocity.head<2>() = shortened(Vector3d(velocity.x(), velocity.y(), 0), gains_.max_speed_mps).head<2>();
  velocity.z() = std::clamp(velocity.z(), -gains_.max_climb_mps, gains_.max_descent_mps);
  return setpoint.acceleration_ned_mps2 + gains_.velocity_per_s * (velocity - velocity_ned(now)) - disturbance_mps2_;
}

Vector3d MultirotorControl::rate_command(const Quaterniond& body_from_wanted, const Vector3d& turning_body) const {
  // The rotation that puts the thrust right, and what is then left about it
  const Vector3d& axis = mixer_.thrust_axis();
  const Quaterniond tilt = Quaterniond::FromTwoVectors(axis, body_from_wanted * axis);
  const Quaterniond rest = tilt.conjugate() * body_from_wanted;
  const double about_axis = std::remainder(2 * std::atan2(rest.vec().dot(axis), rest.w()), 2 * pi);
  const double tilt_angle = 2 * std::atan2(tilt.vec().norm(), std::abs(tilt.w()));
  const double size = tilt.vec().norm();
  const Vector3d tilt_error = size > 0 ? Vector3d(tilt_angle / size * tilt.vec()) : Vector3d::Zero();

  const Vector3d turn =
      shortened(braked(tilt_error, gains_.tilt_per_s, gains_.max_tilt_acceleration_radps2), gains_.max_rate_radps);
  const double yaw = std::clamp(braked(about_axis, gains_.yaw_per_s, gains_.max_yaw_acceleration_radps2),
                                -gains_.max_yaw_rate_radps, gains_.max_yaw_rate_radps);
  return turn + yaw * axis + turning_body;
}

MultirotorControls MultirotorControl::step(const MultirotorSetpoint& setpoint, const Navigation& now, double dt_s,
                                           double supply_v) {
  const Quaterniond ned_from_body = geodesy::quaternion_from(now.attitude);
  learn(velocity_ned(now), dt_s);

  // Acceleration to thrust: level as far as the tilt allows, upright always
  Vector3d thrust_mps2 = acceleration_command(setpoint, now) - Vector3d(0, 0, gravity_mps2_);
  thrust_mps2.z() = std::clamp(thrust_mps2.z(), -mixer_.max_thrust_n() / vehicle_.mass.mass_kg(), -0.2 * gravity_mps2_);
  const double level = std::tan(gains_.max_tilt_rad) * std::min(-thrust_mps2.z(), 1.5 * gravity_mps2_);
  thrust_mps2.head<2>() = shortened(Vector3d(thrust_mps2.x(), thrust_mps2.y(), 0), level).head<2>();
  const Quaterniond wanted = attitude_for(thrust_mps2, setpoint.yaw_rad, mixer_.thrust_axis());

  // Attitude to rates to moments
  const Quaterniond body_from_ned = ned_from_body.conjugate();
  const Vector3d rates = rate_command(body_from_ned * wanted, body_from_ned * Vector3d(0, 0, setpoint.yaw_rate_radps));
  const Vector3d rate_error = rates - now.rates_radps;
  const Vector3d turning = gains_.rate_per_s * rate_error + rate_integral_radps2_;
  const auto& inertia = vehicle_.mass.inertia_kgm2();
  RotorDemand demand;
  demand.thrust_n = std::max(0.0, vehicle_.mass.mass_kg() * thrust_mps2.dot(ned_from_body * mixer_.thrust_axis()));
  demand.moment_nm = inertia * turning + now.rates_radps.cross(inertia * now.rates_radps);

  // Rotors that speed up turn the body before their drag does: what drag is to give follows the more slowly
  if (mixer_.yaw_lead_s() > 0)
    demand.moment_nm.z() = FirstOrderLag(mixer_.yaw_lead_s(), dt_s).held(yaw_drag_nm_, demand.moment_nm.z());

  // Moments to rotors; what they were told is what is learnt from
  const Mixer::Mix mix = mixer_.mix(demand);
  saturated_ = mix.saturated;
  yaw_drag_nm_ = mix.given.moment_nm.z();
  if (!saturated_) rate_integral_radps2_ += gains_.rate_integral_per_s2 * dt_s * rate_error;
  const double most = 0.5 * gains_.max_tilt_acceleration_radps2;
  rate_integral_radps2_ = rate_integral_radps2_.cwiseMax(-most).cwiseMin(most);
  told_acceleration_mps2_ = ned_from_body * (mix.given.thrust_n / vehicle_.mass.mass_kg() * mixer_.thrust_axis()) +
                            Vector3d(0, 0, gravity_mps2_);
  MultirotorControls controls = mixer_.controls_for(mix.thrust_n, model_.followed, gains_.lead_s, supply_v);
  follow_for(vehicle_, controls, dt_s, model_);
  return controls;
}

}  // namespace nadir::sim

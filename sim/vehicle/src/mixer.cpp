#include "nadir/sim/mixer.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "nadir/sim/lag.h"

namespace nadir::sim {
namespace {

using Eigen::Vector3d;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double hover_mps2 = 9.81;  // of the thrust around which torques are taken as proportional to it

/// Torque over thrust of a rotor that carries its share in hover.
double torque_per_thrust_m(const Rotor& rotor, double thrust_n) {
  if (const auto* electric = std::get_if<ElectricDrive>(&rotor.drive))
    return electric->propulsion.cq0 * electric->propulsion.diameter_m / electric->propulsion.ct0;
  const auto& drive = std::get<PulseDrive>(rotor.drive);
  return pulse_output(drive, throttle_for_thrust(rotor, thrust_n, 0, 0)).torque_nm / thrust_n;
}

double lag_of(const Rotor& rotor, double thrust_n, double density) {
  const double lag_s = std::max(rotor.rise_time_constant_s, rotor.fall_time_constant_s);
  const auto* electric = std::get_if<ElectricDrive>(&rotor.drive);
  if (!electric || electric->dynamics.rotor_inertia_kgm2 == 0) return lag_s;
  const double throttle = throttle_for_thrust(rotor, thrust_n, 0, density);
  const double omega = settled_output(rotor, throttle, 0, density).omega_radps;
  return lag_s + mechanical_time_constant_s(electric->propulsion, electric->dynamics, omega, density);
}

/// Time constant of the torque by which a rotor's own inertia leads that of the air, in hover.
double yaw_lead_of(const Rotor& rotor, double thrust_n, double density) {
  const auto* electric = std::get_if<ElectricDrive>(&rotor.drive);
  if (!electric) return 0;
  const RotorOutput hover = settled_output(rotor, throttle_for_thrust(rotor, thrust_n, 0, density), 0, density);
  return electric->dynamics.rotor_inertia_kgm2 * hover.omega_radps / (2 * hover.torque_nm);
}

/// The greatest share of `change`, [0, 1], that keeps `start + share change` within 0 and `high`.
double share_within(const RotorValues& start, const RotorValues& change, const RotorValues& high) {
  double share = 1;
  for (Eigen::Index i = 0; i < start.size(); ++i) {
    if (change[i] > 0) share = std::min(share, std::max(0.0, high[i] - start[i]) / change[i]);
    if (change[i] < 0) share = std::min(share, std::max(0.0, start[i]) / -change[i]);
  }
  return share;
}

/// A command that brings a first-order lag from `now` to `wanted` in `lead_s`.
double led(double now, double wanted, double rise_s, double fall_s, double lead_s) {
  const double lag_s = std::abs(wanted) > std::abs(now) ? rise_s : fall_s;
  if (lag_s <= 0 || lead_s <= 0) return wanted;
  return now + (wanted - now) / followed_share(lag_s, lead_s);
}

}  // namespace

Result<Mixer> Mixer::create(const Multirotor& vehicle, double density_kgpm3) {
  Mixer mixer;
  mixer.vehicle_ = vehicle;
  mixer.density_kgpm3_ = density_kgpm3;
  if (vehicle.lumped) {
    const LumpedRotors& lumped = *vehicle.lumped;
    mixer.max_thrust_ = RotorValues::Constant(1, lumped.max_thrust_n);
    for (const auto& constants : {lumped.rise_time_constant_s, lumped.fall_time_constant_s})
      mixer.slowest_lag_s_ = std::max(mixer.slowest_lag_s_, *std::max_element(constants.begin(), constants.end()));
    return mixer;
  }

  // What a newton of each rotor does, as thrust along the common axis and as moments
  const auto n = static_cast<Eigen::Index>(vehicle.rotors.size());
  Vector3d sum = Vector3d::Zero();
  for (const Rotor& rotor : vehicle.rotors) sum += rotor.thrust_axis;
  if (n < 4 || !(sum.norm() > 0.1 * static_cast<double>(n)))
    return fail(Error::Kind::Unsupported,
                n < 4 ? "multirotor: fewer than four rotors cannot hold thrust, roll, pitch and yaw apart"
                      : "multirotor: the rotors' thrusts cancel each other");
  mixer.axis_ = sum.normalized();
  const double hover_n = vehicle.mass.mass_kg() * hover_mps2 / static_cast<double>(n);
  Eigen::Matrix<double, 4, Eigen::Dynamic, 0, 4, most_rotors> effect(4, n);
  mixer.max_thrust_ = RotorValues::Zero(n);
  double arm_m = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Rotor& rotor = vehicle.rotors[static_cast<std::size_t>(i)];
    const double reaction_m = (rotor.clockwise ? 1 : -1) * torque_per_thrust_m(rotor, hover_n);
    effect(0, i) = mixer.axis_.dot(rotor.thrust_axis);
    effect.col(i).tail<3>() = rotor.position_m.cross(rotor.thrust_axis) + reaction_m * rotor.thrust_axis;
    mixer.max_thrust_[i] = settled_output(rotor, 1, 0, density_kgpm3).thrust_n;
    mixer.slowest_lag_s_ = std::max(mixer.slowest_lag_s_, lag_of(rotor, hover_n, density_kgpm3));
    mixer.yaw_lead_s_ += yaw_lead_of(rotor, hover_n, density_kgpm3) / static_cast<double>(n);
    arm_m = std::max(arm_m, rotor.position_m.norm());
  }

  // Rank, with moments measured by the arm so that units do not count
  Eigen::MatrixXd scaled = effect;
  scaled.bottomRows<3>() /= std::max(arm_m, 1e-9);
  const Eigen::VectorXd sizes = Eigen::JacobiSVD<Eigen::MatrixXd>(scaled).singularValues();
  if (!(sizes[3] > 1e-5 * sizes[0]))
    return fail(Error::Kind::Unsupported,
                "multirotor: the rotors cannot hold thrust, roll, pitch and yaw apart: are they on one line, or do all "
                "of them turn the same way?");
  mixer.thrusts_ = effect.transpose() * (effect * effect.transpose()).inverse();
  if (!(mixer.thrusts_.col(0).minCoeff() > 0))
    return fail(Error::Kind::Unsupported,
                "multirotor: thrust without moments would need a rotor that pulls: the centre of mass lies outside "
                "them");
  return mixer;
}

Mixer::Mix Mixer::mix_lumped(const RotorDemand& demand) const {
  const LumpedRotors& lumped = *vehicle_.lumped;
  Mix out;
  out.given.thrust_n = std::clamp(demand.thrust_n, 0.0, lumped.max_thrust_n);
  out.given.moment_nm = demand.moment_nm.cwiseMax(-lumped.max_moment_nm).cwiseMin(lumped.max_moment_nm);
  out.thrust_n = RotorValues(4);
  out.thrust_n << out.given.thrust_n, out.given.moment_nm.array();
  out.saturated = out.given.thrust_n != demand.thrust_n || out.given.moment_nm != demand.moment_nm;
  return out;
}

Mixer::Mix Mixer::mix(const RotorDemand& demand) const {
  if (vehicle_.lumped) return mix_lumped(demand);
  const Eigen::Index n = max_thrust_.size();
  const RotorValues lift = thrusts_.col(0).array();
  const RotorValues tilt = (thrusts_.middleCols<2>(1) * demand.moment_nm.head<2>()).array();
  const RotorValues yaw = (thrusts_.col(3) * demand.moment_nm.z()).array();

  // Roll and pitch: some thrust has to suit every pair of rotors
  double tilt_share = 1;
  for (Eigen::Index low = 0; low < n; ++low)
    for (Eigen::Index high = 0; high < n; ++high) {
      const double spread = tilt[high] / lift[high] - tilt[low] / lift[low];
      if (spread > 0) tilt_share = std::min(tilt_share, max_thrust_[high] / lift[high] / spread);
    }
  double least = 0, most = infinity;
  for (Eigen::Index i = 0; i < n; ++i) {
    least = std::max(least, -tilt_share * tilt[i] / lift[i]);
    most = std::min(most, (max_thrust_[i] - tilt_share * tilt[i]) / lift[i]);
  }
  const double thrust = std::min(std::max(demand.thrust_n, least), most);
  const RotorValues without_yaw = thrust * lift + tilt_share * tilt;
  const double yaw_share = share_within(without_yaw, yaw, max_thrust_);

  Mix out;
  out.thrust_n = (without_yaw + yaw_share * yaw).max(0.0).min(max_thrust_);
  out.given.thrust_n = thrust;
  out.given.moment_nm << tilt_share * demand.moment_nm.head<2>(), yaw_share * demand.moment_nm.z();
  out.saturated = tilt_share < 1 || yaw_share < 1 || thrust != demand.thrust_n;
  return out;
}

MultirotorControls Mixer::controls_for(const RotorValues& thrust_n, const RotorValues& now, double lead_s,
                                       double supply_v) const {
  MultirotorControls controls{RotorValues::Zero(actuator_count(vehicle_))};
  for (Eigen::Index i = 0; i < controls.actuators.size(); ++i) {
    if (vehicle_.lumped) {
      const auto at = static_cast<std::size_t>(i);
      const double wanted = now.size() > 0 ? led(now[i], thrust_n[i], vehicle_.lumped->rise_time_constant_s[at],
                                                 vehicle_.lumped->fall_time_constant_s[at], lead_s)
                                           : thrust_n[i];
      const double most = i == 0 ? vehicle_.lumped->max_thrust_n : vehicle_.lumped->max_moment_nm[i - 1];
      controls.actuators[i] = std::clamp(wanted / most, i == 0 ? 0.0 : -1.0, 1.0);
      continue;
    }
    const Rotor& rotor = vehicle_.rotors[static_cast<std::size_t>(i)];
    const auto lead = [&](double wanted) {
      return now.size() > 0 ? led(now[i], wanted, rotor.rise_time_constant_s, rotor.fall_time_constant_s, lead_s)
                            : wanted;
    };
    const bool thrust_lags = std::holds_alternative<PulseDrive>(rotor.drive);
    const double throttle = thrust_lags ? throttle_for_thrust(rotor, lead(thrust_n[i]), 0, density_kgpm3_)
                                        : lead(throttle_for_thrust(rotor, thrust_n[i], 0, density_kgpm3_, supply_v));
    controls.actuators[i] = std::clamp(throttle, 0.0, 1.0);
  }
  return controls;
}

Vector3d Mixer::max_moment_nm(double thrust_n) const {
  if (vehicle_.lumped) return vehicle_.lumped->max_moment_nm;
  const RotorValues lift = thrust_n * thrusts_.col(0).array();
  Vector3d most;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double ample = 1e3 * max_thrust_.sum();  // newton metres: more than any arm makes of it
    const RotorValues change = ample * thrusts_.col(axis + 1).array();
    most[axis] = ample * std::min(share_within(lift, change, max_thrust_), share_within(lift, -change, max_thrust_));
  }
  return most;
}

}  // namespace nadir::sim

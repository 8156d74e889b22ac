#include "nadir/sim/multirotor_motion.h"

#include <algorithm>
#include <cmath>

#include "nadir/sim/step.h"

namespace nadir::sim {

Eigen::Index vector_size(const Multirotor& vehicle, CurrentModel currents) {
  const auto n = static_cast<Eigen::Index>(vehicle.rotors.size());
  const auto* drive = n > 0 ? std::get_if<ElectricDrive>(&vehicle.rotors.front().drive) : nullptr;
  const bool dynamic = drive && drive->dynamics.rotor_inertia_kgm2 > 0;
  return 13 + (dynamic ? n : 0) + (dynamic && currents == CurrentModel::Integrated ? n : 0) + (vehicle.battery ? 1 : 0);
}

MultirotorVector to_vector(const Multirotor& vehicle, const MultirotorState& state, CurrentModel currents) {
  MultirotorVector x(vector_size(vehicle, currents));
  x.head<13>() = to_vector(static_cast<const BodyState&>(state));
  const Eigen::Index n = state.omega_radps.size();
  x.segment(13, n) = state.omega_radps.matrix();
  if (currents == CurrentModel::Integrated) x.segment(13 + n, n) = state.current_a.matrix();
  if (vehicle.battery) x[x.size() - 1] = state.charge_ah;
  return x;
}

MultirotorState MultirotorMotion::state_at(double t_s, const BodyVector& x) const {
  MultirotorState state = from_;
  static_cast<BodyState&>(state) = body_state_from_vector(x);
  follow_for(vehicle_, controls_, t_s - from_s_, state);
  return state;
}

MultirotorState MultirotorMotion::state_at(double t_s, const MultirotorVector& x) const {
  MultirotorState state = state_at(t_s, BodyVector(x.head<13>()));
  const Eigen::Index n = state.omega_radps.size();
  state.omega_radps = x.segment(13, n).array().max(0.0);
  if (currents_ == CurrentModel::Integrated) state.current_a = x.segment(13 + n, n).array();
  if (vehicle_.battery) state.charge_ah = std::clamp(x[x.size() - 1], 0.0, vehicle_.battery->capacity_ah);
  return state;
}

BodyVector MultirotorMotion::operator()(double t_s, const BodyVector& x, const Loads& of_ground,
                                        double height_m) const {
  const MultirotorState state = state_at(t_s, x);
  const BodyInAir in_air = body_in_air(state, environment_, air_.at(t_s));
  return body_derivative(vehicle_.mass, state, in_air,
                         output(vehicle_, in_air, state, controls_, height_m, currents_).loads + of_ground);
}

void MultirotorMotion::operator()(double t_s, const MultirotorVector& x, MultirotorVector& change,
                                  const Loads& of_ground, double height_m) const {
  const MultirotorState state = state_at(t_s, x);
  const BodyInAir in_air = body_in_air(state, environment_, air_.at(t_s));
  const MultirotorOutput out = output(vehicle_, in_air, state, controls_, height_m, currents_);
  change.resize(x.size());
  change.head<13>() = body_derivative(vehicle_.mass, state, in_air, out.loads + of_ground);
  const Eigen::Index n = state.omega_radps.size();
  change.segment(13, n) = out.spin_radps2.matrix();
  if (currents_ == CurrentModel::Integrated) change.segment(13 + n, n) = out.current_change_aps.matrix();
  if (vehicle_.battery) change[x.size() - 1] = state.charge_ah > 0 ? -out.supply_current_a / 3600 : 0;
}

double fastest_spin_rate_per_s(const Multirotor& vehicle, const RotorValues& omega_radps, double density_kgpm3) {
  double fastest = 0;
  for (Eigen::Index i = 0; i < omega_radps.size(); ++i) {
    const auto& drive = std::get<ElectricDrive>(vehicle.rotors[static_cast<std::size_t>(i)].drive);
    fastest = std::max(fastest,
                       1 / mechanical_time_constant_s(drive.propulsion, drive.dynamics, omega_radps[i], density_kgpm3));
  }
  return fastest;
}

Result<MultirotorState> advance(const Multirotor& vehicle, const Environment& environment, const MultirotorState& state,
                                const MultirotorControls& controls, const AirOverTime& air, double t_s, double dt_s) {
  CurrentModel currents = CurrentModel::Settled;
  if (state.current_a.size() > 0) {
    const auto& drive = std::get<ElectricDrive>(vehicle.rotors.front().drive);
    if (dt_s <= electrical_time_constant_s(drive.propulsion, drive.dynamics)) currents = CurrentModel::Integrated;
  }
  const MultirotorMotion motion(vehicle, environment, state, controls, air, t_s, currents);
  if (vector_size(vehicle, currents) == 13) {
    BodyVector x = rk4_step(motion, t_s, to_vector(static_cast<const BodyState&>(state)), dt_s);
    renormalise_quaternion(x, body_quaternion_at);
    const auto finite = finite_or_error(x, t_s + dt_s);
    if (!finite) return fail(finite);
    return motion.state_at(t_s + dt_s, *finite);
  }
  // Steps of at most one time constant of the fastest rotor: RK4 is stable up to 2.8, and exact to 1 % at 1
  const double rate = fastest_spin_rate_per_s(vehicle, state.omega_radps, environment.at(state.position).density_kgpm3);
  const int steps = static_cast<int>(std::clamp(std::ceil(rate * dt_s), 1.0, 1000.0));
  MultirotorVector x = to_vector(vehicle, state, currents);
  ExplicitStepper<MultirotorVector> stepper(ExplicitMethod::Rk4, x);
  Work work;
  for (int i = 0; i < steps; ++i) stepper.step(motion, t_s + i * (dt_s / steps), x, dt_s / steps, work);
  renormalise_quaternion(x, body_quaternion_at);
  const auto finite = finite_or_error(x, t_s + dt_s);
  if (!finite) return fail(finite);
  MultirotorState next = motion.state_at(t_s + dt_s, *finite);
  if (currents == CurrentModel::Settled && next.current_a.size() > 0)
    next.current_a = output(vehicle, body_in_air(next, environment, air.at(t_s + dt_s)), next, controls, no_ground_m,
                            CurrentModel::Settled)
                         .current_a;
  return next;
}

}  // namespace nadir::sim

#include "nadir/sim/multirotor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nadir/sim/lag.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

RotorValues zeros(Eigen::Index size) { return RotorValues::Zero(size); }

bool has_inertia(const Rotor& rotor) {
  const auto* electric = std::get_if<ElectricDrive>(&rotor.drive);
  return electric && electric->dynamics.rotor_inertia_kgm2 > 0;
}

/// +1 where a rotor turns right-handed about its thrust.
double sense(const Rotor& rotor) { return rotor.clockwise ? -1 : 1; }

double thrust_axis_speed(const Rotor& rotor, const BodyInAir& in_air) {
  const Vector3d at_hub = in_air.flow.velocity_body_mps + in_air.rates_against_air_radps.cross(rotor.position_m);
  return rotor.thrust_axis.dot(at_hub);
}

/// Share of its thrust that a rotor gains from the ground below.
double ground_gain(const GroundEffect& effect, double radius, double thrust_n, double height_m, double across_mps,
                   double density_kgpm3) {
  if (effect.law != GroundEffect::Law::CheesemanBennett || !(radius > 0) || !(thrust_n > 0)) return 0;
  constexpr double pi = std::numbers::pi;
  const double ratio = radius / (4 * std::max(height_m, radius / 2));
  const double downwash2 = thrust_n / (2 * density_kgpm3 * pi * radius * radius);
  const double image = ratio * ratio * downwash2 / (downwash2 + across_mps * across_mps);
  return image / (1 - image);
}

/// The supply of a vehicle's motors in one moment.
class Supply {
 public:
  Supply(const Multirotor& vehicle, const MultirotorState& state, const RotorValues& throttle)
      : vehicle_(vehicle),
        throttle_(throttle),
        open_v_(vehicle.battery ? open_circuit_v(*vehicle.battery, state.charge_ah) : 0) {}

  double drawn_a(const RotorValues& currents) const {
    return (throttle_ * currents).sum() + vehicle_.battery->other_current_a;
  }
  double voltage_under(double drawn_a) const {
    return std::max(0.0, open_v_ - vehicle_.battery->resistance_ohm * drawn_a);
  }

  /// The voltage at which motors draw what makes it sag to just that. `drawn(v)` rises with v, nearly in proportion.
  template <class Drawn>
  double balance(const Drawn& drawn) const {
    double low = 0, high = open_v_, at = open_v_;
    double at_off = at - voltage_under(drawn(at));
    for (int i = 0; i < 40 && std::abs(at_off) > 1e-12 * open_v_; ++i) {
      (at_off > 0 ? high : low) = at;
      // By the slope of a millionth of the voltage; halved where that leaves the bracket
      const double probe = at * (1 - 1e-6), probe_off = probe - voltage_under(drawn(probe));
      double next = at - at_off * (at - probe) / (at_off - probe_off);
      if (!(next >= low && next <= high)) next = 0.5 * (low + high);
      at = next;
      at_off = at - voltage_under(drawn(at));
    }
    return at;
  }

 private:
  const Multirotor& vehicle_;
  const RotorValues& throttle_;
  double open_v_;
};

/// Motors that follow at once, at a supply voltage: speeds and currents.
void balance_motors(const Multirotor& vehicle, const RotorValues& throttle, const RotorValues& axial_mps,
                    double density, std::optional<double> supply_v, RotorValues& omega, RotorValues& current) {
  for (Eigen::Index i = 0; i < throttle.size(); ++i) {
    const Propulsion& motor = std::get<ElectricDrive>(vehicle.rotors[static_cast<std::size_t>(i)].drive).propulsion;
    const double voltage = throttle[i] * supply_v.value_or(motor.max_voltage_v);
    omega[i] = propel(motor, voltage / motor.max_voltage_v, std::max(0.0, axial_mps[i]), density).omega_radps;
    current[i] = settled_current_a(motor, voltage, omega[i]);
  }
}

/// Electric rotors: speeds, currents and how they change.
void electric_rotors(const Multirotor& vehicle, const BodyInAir& in_air, const MultirotorState& state,
                     const MultirotorControls& controls, CurrentModel currents, MultirotorOutput& out) {
  const auto n = static_cast<Eigen::Index>(vehicle.rotors.size());
  const double density = in_air.here.density_kgpm3;
  RotorValues throttle(n), axial(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Rotor& rotor = vehicle.rotors[static_cast<std::size_t>(i)];
    throttle[i] = state.followed.size() > 0 ? state.followed[i] : std::clamp(controls.actuators[i], 0.0, 1.0);
    axial[i] = thrust_axis_speed(rotor, in_air);
  }
  const bool dynamic = state.omega_radps.size() > 0;
  const Supply supply(vehicle, state, throttle);
  std::optional<double> voltage;  // of the battery
  if (!dynamic) {
    if (vehicle.battery)
      voltage = supply.balance([&](double v) {
        balance_motors(vehicle, throttle, axial, density, v, out.omega_radps, out.current_a);
        return supply.drawn_a(out.current_a);
      });
    balance_motors(vehicle, throttle, axial, density, voltage, out.omega_radps, out.current_a);
  } else {
    out.omega_radps = state.omega_radps;
    const auto drive = [&](Eigen::Index i) -> const ElectricDrive& {
      return std::get<ElectricDrive>(vehicle.rotors[static_cast<std::size_t>(i)].drive);
    };
    if (currents == CurrentModel::Integrated) {
      out.current_a = state.current_a;
      if (vehicle.battery) voltage = supply.voltage_under(supply.drawn_a(out.current_a));
    } else if (vehicle.battery) {  // linear: current is that of the voltage less back-EMF
      voltage = supply.balance([&](double v) {
        for (Eigen::Index i = 0; i < n; ++i)
          out.current_a[i] = settled_current_a(drive(i).propulsion, throttle[i] * v, out.omega_radps[i]);
        return supply.drawn_a(out.current_a);
      });
    }
    out.spin_radps2 = out.current_change_aps = zeros(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto& [motor, dynamics] = drive(i);
      const double volts = throttle[i] * voltage.value_or(motor.max_voltage_v), omega = out.omega_radps[i];
      const double torque = propeller_output(motor, omega, axial[i], density).torque_nm;
      if (currents == CurrentModel::Integrated) {
        out.spin_radps2[i] = spin_change(motor, dynamics, omega, out.current_a[i], torque);
        out.current_change_aps[i] = current_change(motor, dynamics, volts, omega, out.current_a[i]);
      } else {
        out.current_a[i] = settled_current_a(motor, volts, omega);
        out.spin_radps2[i] = settled_spin_change(motor, dynamics, volts, omega, torque);
      }
    }
  }
  if (voltage) {
    out.supply_v = *voltage;
    out.supply_current_a = supply.drawn_a(out.current_a);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const ElectricDrive& drive = std::get<ElectricDrive>(vehicle.rotors[static_cast<std::size_t>(i)].drive);
    const RotorOutput rotor = propeller_output(drive.propulsion, out.omega_radps[i], axial[i], density);
    out.thrust_n[i] = rotor.thrust_n;
    out.torque_nm[i] = rotor.torque_nm;
  }
}

/// Pulse drives: thrust and torque.
void pulse_rotors(const Multirotor& vehicle, const MultirotorState& state, const MultirotorControls& controls,
                  MultirotorOutput& out) {
  if (state.followed.size() > 0) {
    out.thrust_n = state.followed;
    out.torque_nm = state.followed_torque_nm;
    return;
  }
  for (Eigen::Index i = 0; i < out.thrust_n.size(); ++i) {
    const RotorOutput rotor =
        pulse_output(std::get<PulseDrive>(vehicle.rotors[static_cast<std::size_t>(i)].drive), controls.actuators[i]);
    out.thrust_n[i] = rotor.thrust_n;
    out.torque_nm[i] = rotor.torque_nm;
  }
}

/// Loads of one rotor about the centre of mass.
Loads rotor_loads(const Multirotor& vehicle, const BodyInAir& in_air, const MultirotorOutput& out, Eigen::Index i,
                  double height_m, const Vector3d& down_body) {
  const Rotor& rotor = vehicle.rotors[static_cast<std::size_t>(i)];
  const Vector3d at_hub = in_air.flow.velocity_body_mps + in_air.rates_against_air_radps.cross(rotor.position_m);
  const Vector3d across = at_hub - rotor.thrust_axis.dot(at_hub) * rotor.thrust_axis;
  const double gain = ground_gain(vehicle.ground_effect, radius_m(rotor), out.thrust_n[i],
                                  height_m - down_body.dot(rotor.position_m), across.norm(), in_air.here.density_kgpm3);
  const double thrust = out.thrust_n[i] * (1 + gain);
  Loads loads;
  loads.force_body_n = thrust * rotor.thrust_axis - vehicle.drag.induced_spm * thrust * across;
  loads.moment_body_nm =
      rotor.position_m.cross(loads.force_body_n) - sense(rotor) * out.torque_nm[i] * rotor.thrust_axis;
  if (has_inertia(rotor)) {
    const double inertia = std::get<ElectricDrive>(rotor.drive).dynamics.rotor_inertia_kgm2;
    const Vector3d spin_axis = sense(rotor) * inertia * rotor.thrust_axis;
    loads.moment_body_nm -= out.spin_radps2[i] * spin_axis + in_air.rates_radps.cross(out.omega_radps[i] * spin_axis);
  }
  return loads;
}

}  // namespace

int actuator_count(const Multirotor& vehicle) { return vehicle.lumped ? 4 : static_cast<int>(vehicle.rotors.size()); }

MultirotorOutput output(const Multirotor& vehicle, const BodyInAir& in_air, const MultirotorState& state,
                        const MultirotorControls& controls, double height_m, CurrentModel currents) {
  const auto n = static_cast<Eigen::Index>(vehicle.rotors.size());
  MultirotorOutput out;
  out.thrust_n = out.torque_nm = out.omega_radps = out.current_a = zeros(n);
  const double density = in_air.here.density_kgpm3;
  const Vector3d& v = in_air.flow.velocity_body_mps;

  // Rotors
  if (vehicle.lumped) {
    const LumpedRotors& lumped = *vehicle.lumped;
    const double thrust = state.followed[0], across = v.head<2>().norm();
    const double gain = ground_gain(vehicle.ground_effect, lumped.rotor_radius_m, thrust, height_m, across, density);
    out.loads.force_body_n.z() = -thrust * (1 + gain);
    out.loads.force_body_n.head<2>() -= vehicle.drag.induced_spm * thrust * (1 + gain) * v.head<2>();
    out.loads.moment_body_nm = state.followed.segment<3>(1).matrix();
  } else {
    if (std::holds_alternative<ElectricDrive>(vehicle.rotors.front().drive))
      electric_rotors(vehicle, in_air, state, controls, currents, out);
    else
      pulse_rotors(vehicle, state, controls, out);
    const Vector3d down_body = in_air.ecef_from_body.transpose() * in_air.here.ecef_from_ned.col(2);
    for (Eigen::Index i = 0; i < n; ++i)
      out.loads = out.loads + rotor_loads(vehicle, in_air, out, i, height_m, down_body);
  }

  // Drag, and the published ground effect
  const MultirotorDrag& drag = vehicle.drag;
  out.loads.force_body_n -=
      (0.5 * density * drag.coefficient * drag.area_m2 * in_air.flow.airspeed_mps + drag.linear_nspm) * v;
  out.loads.moment_body_nm -= drag.angular_nms * in_air.rates_against_air_radps;
  if (vehicle.ground_effect.law == GroundEffect::Law::Polynomial && std::isfinite(height_m)) {
    double force = 0;
    for (const double c : vehicle.ground_effect.force_n) force = force * height_m + c;
    out.loads.force_body_n.z() -= std::max(0.0, force);
  }
  return out;
}

MultirotorOutput output(const Multirotor& vehicle, const Environment& environment, const MultirotorState& state,
                        const MultirotorControls& controls, const AirMotion& air, double height_m) {
  const CurrentModel currents = state.current_a.size() > 0 ? CurrentModel::Integrated : CurrentModel::Settled;
  return output(vehicle, body_in_air(state, environment, air), state, controls, height_m, currents);
}

void follow_for(const Multirotor& vehicle, const MultirotorControls& controls, double duration_s,
                MultirotorState& state) {
  if (state.followed.size() == 0) return;
  const auto moved = [&](double now, double target, double rise_s, double fall_s) {
    const double lag_s = std::abs(target) > std::abs(now) ? rise_s : fall_s;
    if (duration_s <= 0) return lag_s > 0 ? now : target;
    return now + followed_share(lag_s, duration_s) * (target - now);
  };
  if (vehicle.lumped) {
    const LumpedRotors& lumped = *vehicle.lumped;
    for (Eigen::Index i = 0; i < 4; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const double share = std::clamp(controls.actuators[i], i == 0 ? 0.0 : -1.0, 1.0);
      const double target = share * (i == 0 ? lumped.max_thrust_n : lumped.max_moment_nm[i - 1]);
      state.followed[i] =
          moved(state.followed[i], target, lumped.rise_time_constant_s[at], lumped.fall_time_constant_s[at]);
    }
    return;
  }
  for (Eigen::Index i = 0; i < state.followed.size(); ++i) {
    const Rotor& rotor = vehicle.rotors[static_cast<std::size_t>(i)];
    const double rise = rotor.rise_time_constant_s, fall = rotor.fall_time_constant_s;
    if (const auto* pulse = std::get_if<PulseDrive>(&rotor.drive)) {
      const RotorOutput target = pulse_output(*pulse, controls.actuators[i]);
      state.followed[i] = moved(state.followed[i], target.thrust_n, rise, fall);
      state.followed_torque_nm[i] = moved(state.followed_torque_nm[i], target.torque_nm, rise, fall);
    } else {
      state.followed[i] = moved(state.followed[i], std::clamp(controls.actuators[i], 0.0, 1.0), rise, fall);
    }
  }
}

}  // namespace nadir::sim

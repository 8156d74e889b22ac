#pragma once

#include <cmath>
#include <stdexcept>

#include "nadir/sim/multirotor_control.h"
#include "nadir/sim/multirotor_trim.h"
#include "vehicle/models.h"

namespace nadir::sim {

/// A multirotor with its control, hovering over the scene's origin with the nose north: vehicle at 400 Hz, control at
/// 100 Hz.
class MultirotorLoop {
 public:
  static constexpr double control_s = 0.01;
  static constexpr int steps_per_control = 4;
  static constexpr double gravity = 9.81, density = 1.225;

  explicit MultirotorLoop(const Multirotor& flown, double height_m = 50,
                          const Eigen::Vector3d& wind_ned_mps = Eigen::Vector3d::Zero(), double charge_ah = 0)
      : vehicle(flown),
        wind(wind_ned_mps),
        gains(multirotor_gains(flown, control_s, density, gravity).value()),
        control(flown, Mixer::create(flown, density).value(), gains, gravity) {
    const MultirotorTrimTarget target{-wind.x(), -wind.y(), 0};  // at rest over ground
    const auto hover = trim(vehicle, target, density, gravity, charge_ah).value();
    state = trimmed_state(vehicle, hover, environment, {origin.lat_rad, origin.lon_rad, height_m}, 0, wind, charge_ah);
    control.reset(state, now());
    home = {.position_ned_m = {0, 0, -height_m}};
  }

  Navigation now() const { return true_navigation(state, environment, wind, scene); }
  Eigen::Vector3d position() const {
    const Navigation n = now();
    return {n.north_m, n.east_m, -n.height_m};
  }

  /// Flies on. `setpoint(time)` 100 times a second; `look(time)` is shown every such moment; `change(controls)` may put
  /// other controls in their place.
  template <class Setpoint, class Look, class Change>
  void fly(double seconds, const Setpoint& setpoint, const Look& look, const Change& change) {
    const long end = step + std::lround(seconds / control_s);
    for (; step < end; ++step) {
      const double t = static_cast<double>(step) * control_s;
      look(t);
      const double volts = vehicle.battery ? output(vehicle, environment, state, controls_or_off(), wind).supply_v : 0;
      controls = control.step(setpoint(t), now(), control_s, volts);
      change(controls);
      for (int i = 0; i < steps_per_control; ++i) {
        constexpr double dt = control_s / steps_per_control;
        const auto next = advance(vehicle, environment, state, controls, wind, t + i * dt, dt);
        if (!next) throw std::runtime_error(next.error().message);
        state = *next;
      }
    }
  }
  template <class Setpoint, class Look>
  void fly(double seconds, const Setpoint& setpoint, const Look& look) {
    fly(seconds, setpoint, look, [](MultirotorControls&) {});
  }

  const geodesy::Geodetic origin = geodesy::Geodetic::degrees(38.1, -0.76, 0);
  const Environment environment = Environment::flat(origin, gravity, density);
  const geodesy::LocalFrame scene{origin};
  const Multirotor vehicle;
  const Eigen::Vector3d wind;
  const MultirotorGains gains;
  MultirotorControl control;
  MultirotorState state;
  MultirotorControls controls;
  MultirotorSetpoint home;
  long step = 0;

 private:
  MultirotorControls controls_or_off() const {
    return controls.actuators.size() > 0 ? controls : MultirotorControls{RotorValues::Zero(actuator_count(vehicle))};
  }
};

/// The published one with motors that take their time.
inline Multirotor with_motor_inertia() {
  Multirotor vehicle = quadrotor();
  for (Rotor& rotor : vehicle.rotors)
    std::get<ElectricDrive>(rotor.drive).dynamics = {.rotor_inertia_kgm2 = 2e-4, .inductance_h = 2e-4 * 0.042};
  return vehicle;
}

}  // namespace nadir::sim

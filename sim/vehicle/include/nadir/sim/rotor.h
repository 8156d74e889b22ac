#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <variant>
#include <vector>

#include "nadir/sim/parameter_fault.h"
#include "nadir/sim/propulsion.h"

namespace nadir::sim {

/// A propeller on an electric motor.
struct ElectricDrive {
  Propulsion propulsion;
  MotorDynamics dynamics;
  friend bool operator==(const ElectricDrive&, const ElectricDrive&) = default;
};

/// Thrust and torque as quadratics of the width of a servo pulse, 1000 us at throttle 0 and 2000 us at 1; neither is
/// below 0. Nothing is known of the propeller's speed, nor of the air that it meets.
struct PulseDrive {
  std::array<double, 3> thrust_n{}, torque_nm{};  // per us^2, per us, constant
  double max_thrust_n = 0;
  double radius_m = 0;  // of the propeller, for ground effect
  friend bool operator==(const PulseDrive&, const PulseDrive&) = default;
};
using RotorDrive = std::variant<ElectricDrive, PulseDrive>;

/// What is wrong with a drive, by the key of `electric` or `pulse` in a parameter file.
std::vector<ParameterFault> faults_of(const RotorDrive& drive);

/// A rotor of a multirotor.
struct Rotor {
  std::string name = {};                                    // for messages
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();     // of its hub, in the body
  Eigen::Vector3d thrust_axis = -Eigen::Vector3d::UnitZ();  // the way its thrust points, in the body; unit length
  bool clockwise = false;                                   // seen against that axis: from above where it points up
  RotorDrive drive;
  /// First-order lag of an electric drive's throttle, of a pulse drive's thrust and torque; 0: none.
  double rise_time_constant_s = 0, fall_time_constant_s = 0;
};

/// One for each rotor, of which there are at most 16.
constexpr int most_rotors = 16;
using RotorValues = Eigen::Array<double, Eigen::Dynamic, 1, 0, most_rotors, 1>;

/// What a rotor does in one moment.
struct RotorOutput {
  double thrust_n = 0, torque_nm = 0;  // neither below 0
  double omega_radps = 0, current_a = 0;
};

double radius_m(const Rotor& rotor);

/// A pulse drive that has settled.
RotorOutput pulse_output(const PulseDrive& drive, double throttle);

/// The propeller of an electric drive at a speed. `axial_mps`: of the rotor against the air, along its thrust; where it
/// is negative it counts as 0, since the coefficients end there. Where a coefficient passes below 0 in a fast climb it
/// is 1e-4, as in the source: rosflight_sim (ROS 2).
RotorOutput propeller_output(const Propulsion& propulsion, double omega_radps, double axial_mps, double density_kgpm3);

/// A rotor at rest in the air once it has settled, throttle limited. `voltage_v`: of the supply; 0: the motor's
/// greatest.
RotorOutput settled_output(const Rotor& rotor, double throttle, double axial_mps, double density_kgpm3,
                           double voltage_v = 0);

/// The throttle of a thrust in that state; not limited above 1. None gives less than no thrust.
double throttle_for_thrust(const Rotor& rotor, double thrust_n, double axial_mps, double density_kgpm3,
                           double voltage_v = 0);

}  // namespace nadir::sim

#include <fmt/format.h>

#include <cmath>

#include "nadir/sim/multirotor.h"

namespace nadir::sim {
namespace {

class Faults {
 public:
  void positive(const char* key, double value, const char* what, const char* unit) {
    if (!(value > 0) || !std::isfinite(value)) add(key, "expected {} above 0{}, found {}", what, unit, value);
  }
  void not_negative(const char* key, double value, const char* what, const char* unit) {
    if (!(value >= 0) || !std::isfinite(value)) add(key, "expected {} of 0{} or more, found {}", what, unit, value);
  }
  template <class... Args>
  void add(std::string key, fmt::format_string<Args...> text, Args&&... args) {
    found.push_back({std::move(key), fmt::format(text, std::forward<Args>(args)...)});
  }
  /// What is wrong with a part, under the key of the part.
  void add_all(const std::string& key, std::vector<ParameterFault> of_part) {
    for (ParameterFault& fault : of_part)
      found.push_back({key, fault.key.empty() ? fault.message : fault.key + ": " + fault.message});
  }

  std::vector<ParameterFault> found;
};

std::vector<ParameterFault> electric_faults(const ElectricDrive& drive) {
  Faults faults;
  const Propulsion& motor = drive.propulsion;
  faults.positive("diameter_m", motor.diameter_m, "a diameter", " m");
  faults.positive("thrust", motor.ct0, "a first number", "");
  faults.positive("torque", motor.cq0, "a first number", "");
  faults.positive("kq_vspr", motor.kq_vspr, "a motor constant", " V s/rad");
  faults.positive("max_voltage_v", motor.max_voltage_v, "a voltage", " V");
  faults.positive("resistance_ohm", motor.resistance_ohm, "a resistance", " ohm");
  faults.not_negative("no_load_current_a", motor.no_load_current_a, "a no-load current", " A");
  faults.not_negative("rotor_inertia_kgm2", drive.dynamics.rotor_inertia_kgm2, "a rotor inertia", " kg m^2");
  faults.not_negative("inductance_h", drive.dynamics.inductance_h, "an inductance", " H");
  if (drive.dynamics.inductance_h > 0 && drive.dynamics.rotor_inertia_kgm2 == 0)
    faults.add("inductance_h", "it needs a rotor inertia: a current that lags drives a speed that changes");
  const double winding_s = electrical_time_constant_s(motor, drive.dynamics);
  const double motor_s = drive.dynamics.rotor_inertia_kgm2 * motor.resistance_ohm / (motor.kq_vspr * motor.kq_vspr);
  if (winding_s > 0 && motor_s > 0 && winding_s > 0.25 * motor_s)
    faults.add("inductance_h",
               "an electrical time constant of {:.3g} s is more than a quarter of the mechanical one, {:.3g} s: speed "
               "would oscillate; is the unit of the inductance H?",
               winding_s, motor_s);
  return faults.found;
}

std::vector<ParameterFault> pulse_faults(const PulseDrive& drive) {
  Faults faults;
  faults.positive("max_thrust_n", drive.max_thrust_n, "a greatest thrust", " N");
  faults.not_negative("radius_m", drive.radius_m, "a radius", " m");
  if (!(pulse_output(drive, 1).thrust_n > pulse_output(drive, 0).thrust_n))
    faults.add("thrust_n", "thrust does not grow from a pulse of 1000 us to one of 2000 us");
  return faults.found;
}

std::vector<ParameterFault> rotor_faults(const Rotor& rotor) {
  Faults faults;
  if (!rotor.position_m.allFinite()) faults.add("place_m", "it is not finite");
  if (!(std::abs(rotor.thrust_axis.norm() - 1) < 1e-6))
    faults.add("thrust_axis", "expected a length of 1, found {}", rotor.thrust_axis.norm());
  faults.not_negative("rise_time_constant_s", rotor.rise_time_constant_s, "a time constant", " s");
  faults.not_negative("fall_time_constant_s", rotor.fall_time_constant_s, "a time constant", " s");
  faults.add_all("drive", faults_of(rotor.drive));
  return faults.found;
}

/// What differs between rotors though a vehicle has it for all of them or for none.
enum class Kind { Electric, ElectricWithInertia, ElectricWithInductance, Pulse };
Kind kind_of(const Rotor& rotor) {
  const auto* electric = std::get_if<ElectricDrive>(&rotor.drive);
  if (!electric) return Kind::Pulse;
  if (electric->dynamics.inductance_h > 0) return Kind::ElectricWithInductance;
  return electric->dynamics.rotor_inertia_kgm2 > 0 ? Kind::ElectricWithInertia : Kind::Electric;
}

std::vector<ParameterFault> lumped_faults(const LumpedRotors& lumped) {
  Faults faults;
  faults.positive("max_thrust_n", lumped.max_thrust_n, "a greatest thrust", " N");
  for (const double moment : lumped.max_moment_nm) faults.positive("max_moment_nm", moment, "moments", " N m");
  for (const double constant : lumped.rise_time_constant_s)
    faults.not_negative("rise_time_constant_s", constant, "time constants", " s");
  for (const double constant : lumped.fall_time_constant_s)
    faults.not_negative("fall_time_constant_s", constant, "time constants", " s");
  faults.not_negative("rotor_radius_m", lumped.rotor_radius_m, "a rotor radius", " m");
  return faults.found;
}

std::vector<ParameterFault> drag_faults(const MultirotorDrag& drag) {
  Faults faults;
  faults.not_negative("coefficient", drag.coefficient, "a drag coefficient", "");
  faults.not_negative("area_m2", drag.area_m2, "a drag area", " m^2");
  faults.not_negative("linear_nspm", drag.linear_nspm, "a linear drag", " N s/m");
  faults.not_negative("angular_nms", drag.angular_nms, "an angular drag", " N m s");
  faults.not_negative("induced_spm", drag.induced_spm, "an induced drag", " s/m");
  return faults.found;
}

std::string name_of(const std::vector<Rotor>& rotors, std::size_t i) {
  return rotors[i].name.empty() ? std::to_string(i + 1) : rotors[i].name;
}

}  // namespace

std::vector<ParameterFault> faults_of(const RotorDrive& drive) {
  const auto* electric = std::get_if<ElectricDrive>(&drive);
  return electric ? electric_faults(*electric) : pulse_faults(std::get<PulseDrive>(drive));
}

std::vector<ParameterFault> faults_of(const Multirotor& vehicle) {
  Faults faults;
  const std::vector<Rotor>& rotors = vehicle.rotors;
  if (vehicle.lumped) {
    if (!rotors.empty()) faults.add("lumped", "expected it or rotors, found both");
    if (vehicle.battery) faults.add("battery", "a battery needs electric motors, and rotors are lumped");
    faults.add_all("lumped", lumped_faults(*vehicle.lumped));
  } else if (rotors.empty() || rotors.size() > most_rotors) {
    faults.add("rotors", "expected 1 to {} rotors, found {}", most_rotors, rotors.size());
  }
  faults.add_all("drag", drag_faults(vehicle.drag));
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    faults.add_all("rotors." + name_of(rotors, i), rotor_faults(rotors[i]));
    if (kind_of(rotors[i]) != kind_of(rotors[0]))
      faults.add("rotors." + name_of(rotors, i),
                 "it is not driven like rotor {}: all are electric or all by pulses, and all or none have inertia and "
                 "inductance",
                 name_of(rotors, 0));
  }
  if (vehicle.battery) {
    if (!rotors.empty() && kind_of(rotors[0]) == Kind::Pulse)
      faults.add("battery", "a battery needs electric motors, and rotors are driven by pulses");
    faults.add_all("battery", faults_of(*vehicle.battery));
  }
  return faults.found;
}

}  // namespace nadir::sim

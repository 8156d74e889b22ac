#include <fmt/format.h>

#include <cmath>

#include "nadir/sim/multirotor.h"

namespace nadir::sim {
namespace {

class Faults {
 public:
  explicit Faults(std::string about) : about_(std::move(about)) {}

  void positive(double value, const char* what, const char* unit) {
    if (!(value > 0) || !std::isfinite(value)) add("expected {} above 0 {}, found {}", what, unit, value);
  }
  void not_negative(double value, const char* what, const char* unit) {
    if (!(value >= 0) || !std::isfinite(value)) add("expected {} of 0 {} or more, found {}", what, unit, value);
  }
  template <class... Args>
  void add(fmt::format_string<Args...> text, Args&&... args) {
    found.push_back(about_ + ": " + fmt::format(text, std::forward<Args>(args)...));
  }

  std::vector<std::string> found;

 private:
  std::string about_;
};

void check_motor(const ElectricDrive& drive, Faults& faults) {
  const Propulsion& motor = drive.propulsion;
  faults.positive(motor.diameter_m, "a diameter", "m");
  faults.positive(motor.ct0, "ct0", "");
  faults.positive(motor.cq0, "cq0", "");
  faults.positive(motor.kq_vspr, "a motor constant", "V s/rad");
  faults.positive(motor.max_voltage_v, "a voltage", "V");
  faults.positive(motor.resistance_ohm, "a resistance", "ohm");
  faults.not_negative(motor.no_load_current_a, "a no-load current", "A");
  faults.not_negative(drive.dynamics.rotor_inertia_kgm2, "a rotor inertia", "kg m^2");
  faults.not_negative(drive.dynamics.inductance_h, "an inductance", "H");
  if (drive.dynamics.inductance_h > 0 && drive.dynamics.rotor_inertia_kgm2 == 0)
    faults.add("an inductance needs a rotor inertia: a current that lags drives a speed that changes");
  const double winding_s = electrical_time_constant_s(motor, drive.dynamics);
  const double motor_s = drive.dynamics.rotor_inertia_kgm2 * motor.resistance_ohm / (motor.kq_vspr * motor.kq_vspr);
  if (winding_s > 0 && winding_s > 0.25 * motor_s)
    faults.add(
        "an electrical time constant of {:.3g} s is more than a quarter of the mechanical one, {:.3g} s: speed would "
        "oscillate; is the unit of the inductance H?",
        winding_s, motor_s);
}

void check_pulse(const PulseDrive& drive, Faults& faults) {
  faults.positive(drive.max_thrust_n, "a greatest thrust", "N");
  faults.not_negative(drive.radius_m, "a radius", "m");
  if (!(pulse_output(drive, 1).thrust_n > pulse_output(drive, 0).thrust_n))
    faults.add("thrust does not grow from a pulse of 1000 us to one of 2000 us");
}

std::vector<std::string> rotor_faults(const Rotor& rotor, std::size_t number) {
  Faults faults(fmt::format("rotor {}", number));
  if (!rotor.position_m.allFinite()) faults.add("its position is not finite");
  if (!(std::abs(rotor.thrust_axis.norm() - 1) < 1e-6))
    faults.add("expected a thrust axis of length 1, found {}", rotor.thrust_axis.norm());
  faults.not_negative(rotor.rise_time_constant_s, "a rise time constant", "s");
  faults.not_negative(rotor.fall_time_constant_s, "a fall time constant", "s");
  if (const auto* electric = std::get_if<ElectricDrive>(&rotor.drive))
    check_motor(*electric, faults);
  else
    check_pulse(std::get<PulseDrive>(rotor.drive), faults);
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

void check_lumped(const LumpedRotors& lumped, Faults& faults) {
  faults.positive(lumped.max_thrust_n, "a greatest thrust", "N");
  for (const double moment : lumped.max_moment_nm) faults.positive(moment, "greatest moments", "N m");
  for (const auto& constants : {lumped.rise_time_constant_s, lumped.fall_time_constant_s})
    for (const double constant : constants) faults.not_negative(constant, "time constants", "s");
  faults.not_negative(lumped.rotor_radius_m, "a rotor radius", "m");
}

}  // namespace

std::vector<std::string> faults_of(const Multirotor& vehicle) {
  Faults faults("multirotor");
  if (vehicle.lumped) {
    if (!vehicle.rotors.empty()) faults.add("expected rotors or lumped rotors, found both");
    if (vehicle.battery) faults.add("a battery needs electric motors, and rotors are lumped");
    check_lumped(*vehicle.lumped, faults);
  } else if (vehicle.rotors.empty() || vehicle.rotors.size() > most_rotors) {
    faults.add("expected 1 to {} rotors, found {}", most_rotors, vehicle.rotors.size());
  }
  const MultirotorDrag& drag = vehicle.drag;
  faults.not_negative(drag.coefficient, "a drag coefficient", "");
  faults.not_negative(drag.area_m2, "a drag area", "m^2");
  faults.not_negative(drag.linear_nspm, "a linear drag", "N s/m");
  faults.not_negative(drag.angular_nms, "an angular drag", "N m s");
  faults.not_negative(drag.induced_spm, "an induced drag", "s/m");
  for (std::size_t i = 0; i < vehicle.rotors.size(); ++i) {
    for (std::string& fault : rotor_faults(vehicle.rotors[i], i + 1)) faults.found.push_back(std::move(fault));
    if (kind_of(vehicle.rotors[i]) != kind_of(vehicle.rotors[0]))
      faults.add(
          "rotors {} and 1 are not driven alike: all are electric or all by pulses, and all or none have "
          "inertia and inductance",
          i + 1);
  }
  if (vehicle.battery) {
    if (!vehicle.rotors.empty() && kind_of(vehicle.rotors[0]) == Kind::Pulse)
      faults.add("a battery needs electric motors, and rotors are driven by pulses");
    for (std::string& fault : faults_of(*vehicle.battery)) faults.found.push_back(std::move(fault));
  }
  return faults.found;
}

}  // namespace nadir::sim

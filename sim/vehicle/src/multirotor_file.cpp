#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nadir/base/text.h"
#include "nadir/sim/mixer.h"
#include "nadir/sim/multirotor_trim.h"
#include "nadir/sim/vehicle_file.h"
#include "parameter_sections.h"
#include "vehicle_kinds.h"

namespace nadir::sim {
namespace {

constexpr ParameterRange pulse_range = {-1e4, 1e4}, thrust_range = {0, 1e6, true, "is it in grams?"},
                         moment_range = {0, 1e6, true}, axis_range = {-1000, 1000}, drag_range = {0, 1e4},
                         spin_inertia_range = {0, 100, false, "is it in g cm^2? 1e-7 of that is in kg m^2"},
                         inductance_range = {0, 1, false, "is it in microhenries?"}, polynomial_range = {-1e6, 1e6};
constexpr double sea_level_kgpm3 = 1.225, gravity_mps2 = 9.80665;

constexpr std::array<std::string_view, 2> senses = {"counterclockwise", "clockwise"};
enum class Sense { Counterclockwise, Clockwise };
constexpr std::array<std::string_view, 2> ground_laws = {"none", "cheeseman_bennett"};

void read_electric_drive(const ParameterLayer& layer, ElectricDrive& drive) {
  const std::size_t before = layer.yaml().fault_count();
  read_electric(layer, drive.propulsion);
  layer.optional_number("rotor_inertia_kgm2", spin_inertia_range, drive.dynamics.rotor_inertia_kgm2);
  layer.optional_number("inductance_h", inductance_range, drive.dynamics.inductance_h);
  note_faults(layer.yaml(), before, faults_of(RotorDrive(drive)));
}

void read_pulse_drive(const ParameterLayer& layer, PulseDrive& drive) {
  const std::size_t before = layer.yaml().fault_count();
  layer.numbers("thrust_n", pulse_range, drive.thrust_n);
  layer.numbers("torque_nm", pulse_range, drive.torque_nm);
  layer.number("max_thrust_n", thrust_range, drive.max_thrust_n);
  layer.number("radius_m", length_range, drive.radius_m);
  note_faults(layer.yaml(), before, faults_of(RotorDrive(drive)));
}

/// False where it has faults.
bool read_drive(const ParameterLayer& layer, Rotor& rotor) {
  const YamlMap& yaml = layer.yaml();
  const std::size_t before = yaml.fault_count();
  const bool electric = yaml.has("electric"), pulse = yaml.has("pulse");
  if (electric && pulse)
    yaml.fault("pulse", "expected it or electric, found both");
  else if (electric)
    read_kind<ElectricDrive>(layer, "electric", rotor.drive, read_electric_drive);
  else if (pulse)
    read_kind<PulseDrive>(layer, "pulse", rotor.drive, read_pulse_drive);
  else if (layer.complete())
    yaml.require("electric");
  layer.optional_number("rise_time_constant_s", lag_range, rotor.rise_time_constant_s);
  layer.optional_number("fall_time_constant_s", lag_range, rotor.fall_time_constant_s);
  return yaml.fault_count() == before;
}

void read_rotor(const ParameterLayer& layer, bool driven, Rotor& rotor) {
  const YamlMap& yaml = layer.yaml();
  layer.numbers("place_m", place_range, {rotor.position_m.data(), 3});
  if (layer.complete()) yaml.require("turns");
  if (const auto name = yaml.text("turns"))
    if (const auto sense = yaml.value_of<Sense>("turns", parse_name<Sense>("sense of rotation", *name, senses)))
      rotor.clockwise = *sense == Sense::Clockwise;
  if (yaml.has("thrust_axis")) {
    Eigen::Vector3d axis = rotor.thrust_axis;
    layer.numbers("thrust_axis", axis_range, {axis.data(), 3});
    if (!(axis.norm() > 1e-6)) yaml.fault("thrust_axis", "expected a direction, found one of no length");
    // One that was written with unit length keeps its bits
    rotor.thrust_axis = std::abs(axis.norm() - 1) < 1e-12 ? axis : axis.normalized();
  }
  if (!driven) yaml.require("drive");
  if (const auto drive = layer.optional_section("drive")) read_drive(ParameterLayer(drive->yaml(), !driven), rotor);
}

void drive_like(const Rotor& other, Rotor& rotor) {
  rotor.drive = other.drive;
  rotor.rise_time_constant_s = other.rise_time_constant_s;
  rotor.fall_time_constant_s = other.fall_time_constant_s;
}

/// Rotors by name, of a drive for all of them or of their own. Gives the section, for what is wrong with one of them.
std::optional<YamlMap> read_rotors(const ParameterLayer& layer, std::vector<Rotor>& rotors) {
  bool driven = !rotors.empty();
  Rotor common;  // drive of those that are added
  if (driven) drive_like(rotors[0], common);
  if (const auto drive = layer.optional_section("drive")) {
    if (read_drive(ParameterLayer(drive->yaml(), !driven), common))
      for (Rotor& rotor : rotors) drive_like(common, rotor);
    driven = true;
  }
  const auto section = layer.optional_section("rotors");
  if (!section) return std::nullopt;
  for (const auto& [name, entry] : section->yaml().entries()) {
    const NamedPart rotor(rotors, name, common);
    read_rotor(ParameterLayer(entry, rotor.added), driven, *rotor.part);
  }
  return section->yaml();
}

void read_lumped(const ParameterLayer& layer, std::optional<LumpedRotors>& lumped) {
  const auto yaml = layer.yaml().map("lumped");
  if (!yaml) return;
  const ParameterLayer section(*yaml, !lumped);
  if (!lumped) lumped.emplace();
  section.number("max_thrust_n", thrust_range, lumped->max_thrust_n);
  section.numbers("max_moment_nm", moment_range, {lumped->max_moment_nm.data(), 3});
  section.numbers("rise_time_constant_s", lag_range, lumped->rise_time_constant_s);
  section.numbers("fall_time_constant_s", lag_range, lumped->fall_time_constant_s);
  section.number("rotor_radius_m", length_range, lumped->rotor_radius_m);
}

void read_drag(const ParameterLayer& layer, MultirotorDrag& drag) {
  layer.optional_number("coefficient", drag_range, drag.coefficient);
  layer.optional_number("area_m2", drag_range, drag.area_m2);
  layer.optional_number("linear_nspm", drag_range, drag.linear_nspm);
  layer.optional_number("angular_nms", drag_range, drag.angular_nms);
  layer.optional_number("induced_spm", drag_range, drag.induced_spm);
}

void read_ground_effect(const ParameterLayer& layer, GroundEffect& effect) {
  const YamlMap& yaml = layer.yaml();
  if (layer.complete()) effect.law = GroundEffect::Law::CheesemanBennett;
  if (yaml.is_map("ground_effect")) {
    effect.law = GroundEffect::Law::Polynomial;
    ParameterLayer(*yaml.map("ground_effect"), true).numbers("polynomial_n", polynomial_range, effect.force_n);
  } else if (const auto name = yaml.text("ground_effect")) {
    const auto law = parse_name<GroundEffect::Law>("ground effect", *name, ground_laws);
    if (const auto value = yaml.value_of<GroundEffect::Law>("ground_effect", law)) effect.law = *value;
  }
}

/// Mass within what rotors reach: else a unit is mistaken.
void check_gyration(const YamlMap& yaml, const Multirotor& vehicle) {
  double reach_m = 0;
  for (const Rotor& rotor : vehicle.rotors) reach_m = std::max(reach_m, rotor.position_m.norm() + radius_m(rotor));
  const double gyration_m = std::sqrt(vehicle.mass.inertia_kgm2().diagonal().maxCoeff() / vehicle.mass.mass_kg());
  if (!vehicle.rotors.empty() && gyration_m > reach_m)
    yaml.fault("inertia_kgm2", fmt::format("expected mass within {:.4g} m, where rotors end, found a radius of "
                                           "gyration of {:.4g} m: are they in kg and kg m^2?",
                                           reach_m, gyration_m));
}

std::string drive_text(const Rotor& rotor) {
  std::string text;
  if (const auto* electric = std::get_if<ElectricDrive>(&rotor.drive)) {
    text =
        fmt::format("{{electric: {{{}, rotor_inertia_kgm2: {}, inductance_h: {}}}", electric_text(electric->propulsion),
                    electric->dynamics.rotor_inertia_kgm2, electric->dynamics.inductance_h);
  } else {
    const auto& pulse = std::get<PulseDrive>(rotor.drive);
    text = fmt::format("{{pulse: {{thrust_n: [{}], torque_nm: [{}], max_thrust_n: {}, radius_m: {}}}",
                       fmt::join(pulse.thrust_n, ", "), fmt::join(pulse.torque_nm, ", "), pulse.max_thrust_n,
                       pulse.radius_m);
  }
  return fmt::format("{}, rise_time_constant_s: {}, fall_time_constant_s: {}}}", text, rotor.rise_time_constant_s,
                     rotor.fall_time_constant_s);
}

std::string rotors_text(const std::vector<Rotor>& rotors) {
  const std::string common = drive_text(rotors[0]);
  std::string text = "drive: " + common + "\nrotors:\n";
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    const Rotor& r = rotors[i];
    const Eigen::Vector3d &p = r.position_m, &a = r.thrust_axis;
    const std::string own = drive_text(r);
    text += fmt::format("  {}: {{place_m: [{}, {}, {}], thrust_axis: [{}, {}, {}], turns: {}{}}}\n",
                        yaml_quoted(r.name.empty() ? fmt::format("rotor {}", i + 1) : r.name), p.x(), p.y(), p.z(),
                        a.x(), a.y(), a.z(), senses[r.clockwise], own == common ? "" : ", drive: " + own);
  }
  return text;
}

}  // namespace

void apply(const ParameterLayer& layer, Multirotor& vehicle) {
  const YamlMap& yaml = layer.yaml();
  const std::size_t before = yaml.fault_count();
  read_mass(layer, vehicle.mass);
  const auto rotors = read_rotors(layer, vehicle.rotors);
  read_lumped(layer, vehicle.lumped);
  if (vehicle.lumped && yaml.has("drive")) yaml.fault("drive", "expected none, since rotors are lumped");
  if (layer.complete() && !yaml.has("rotors") && !vehicle.lumped) yaml.require("rotors");
  if (const auto drag = layer.optional_section("drag")) read_drag(*drag, vehicle.drag);
  read_ground_effect(layer, vehicle.ground_effect);
  if (const auto battery = yaml.map("battery")) read_battery(*battery, vehicle.battery);
  read_gear(layer, vehicle.gear);

  // What numbers mean together, where each of them can be
  if (yaml.fault_count() != before) return;
  for (const ParameterFault& fault : faults_of(vehicle)) {
    constexpr std::string_view of_rotor = "rotors.";
    if (rotors && fault.key.starts_with(of_rotor))
      rotors->fault(fault.key.substr(of_rotor.size()), fault.message);
    else
      yaml.fault(fault.key, fault.message);
  }
  if (yaml.fault_count() != before) return;
  check_gyration(yaml, vehicle);
  if (const auto mixer = Mixer::create(vehicle, sea_level_kgpm3); !mixer) yaml.fault("rotors", mixer.error().message);
}

std::vector<std::string> warnings_of(const Multirotor& vehicle) {
  std::vector<std::string> warnings;
  const auto warn = [&](std::string text) { warnings.push_back(std::move(text)); };
  const auto hover = [&](double weights, double charge_share) {
    const double kilograms = vehicle.mass.mass_kg() * weights;
    const Eigen::Matrix3d j = vehicle.mass.inertia_kgm2() * weights;
    Multirotor heavy = vehicle;
    heavy.mass = MassProperties::create(kilograms, {j(0, 0), j(1, 1), j(2, 2), -j(0, 1), -j(0, 2), -j(1, 2)}).value();
    return trim(heavy, {}, sea_level_kgpm3, gravity_mps2,
                vehicle.battery ? charge_share * vehicle.battery->capacity_ah : 0);
  };
  const auto level = hover(1, 1);
  if (!level) return {"cannot hover at sea level: " + level.error().message};
  if (vehicle.gear) warn_of_gear(*vehicle.gear, vehicle.mass.mass_kg(), warnings);
  const RotorValues throttle =
      vehicle.lumped ? RotorValues(level->controls.actuators.head(1)) : level->controls.actuators;
  constexpr double reserve = 1.5, last_share = 0.2;
  if (!hover(reserve, 1))
    warn(fmt::format("little thrust: it cannot lift {} times its weight, and hovers at a throttle of {:.2f}", reserve,
                     throttle.maxCoeff()));
  if (throttle.maxCoeff() - throttle.minCoeff() > 0.1)
    warn(
        fmt::format("lopsided: it hovers at throttles of {:.2f} to {:.2f}, so its centre of mass lies off the middle "
                    "of its rotors",
                    throttle.minCoeff(), throttle.maxCoeff()));
  if (vehicle.battery) {
    if (!hover(1, last_share)) warn(fmt::format("cannot hover on the last {:.0f} % of its battery", 100 * last_share));
    const double full_v = vehicle.battery->open_circuit.back().voltage_v;
    const double motor_v = std::get<ElectricDrive>(vehicle.rotors[0].drive).propulsion.max_voltage_v;
    if (full_v > 1.3 * motor_v || full_v < 0.7 * motor_v)
      warn(fmt::format("its full battery has {:.1f} V, and its motors are for {} V", full_v, motor_v));
  }
  return warnings;
}

std::string text_of(const Multirotor& vehicle) {
  std::string text = mass_text(vehicle.mass);
  if (!vehicle.rotors.empty()) text += rotors_text(vehicle.rotors);
  if (const auto& l = vehicle.lumped)
    text += fmt::format(
        "lumped: {{max_thrust_n: {}, max_moment_nm: [{}, {}, {}], rise_time_constant_s: [{}], fall_time_constant_s: "
        "[{}], rotor_radius_m: {}}}\n",
        l->max_thrust_n, l->max_moment_nm.x(), l->max_moment_nm.y(), l->max_moment_nm.z(),
        fmt::join(l->rise_time_constant_s, ", "), fmt::join(l->fall_time_constant_s, ", "), l->rotor_radius_m);
  const MultirotorDrag& d = vehicle.drag;
  text += fmt::format("drag: {{coefficient: {}, area_m2: {}, linear_nspm: {}, angular_nms: {}, induced_spm: {}}}\n",
                      d.coefficient, d.area_m2, d.linear_nspm, d.angular_nms, d.induced_spm);
  text += vehicle.ground_effect.law == GroundEffect::Law::Polynomial
              ? fmt::format("ground_effect: {{polynomial_n: [{}]}}\n", fmt::join(vehicle.ground_effect.force_n, ", "))
              : fmt::format("ground_effect: {}\n", ground_laws[static_cast<std::size_t>(vehicle.ground_effect.law)]);
  if (vehicle.battery) text += fmt::format("battery: {{{}}}\n", battery_text(*vehicle.battery));
  if (vehicle.gear) text += gear_text(*vehicle.gear);
  return text;
}

}  // namespace nadir::sim

#include "parameter_sections.h"

#include <fmt/format.h>

#include <array>
#include <limits>

#include "nadir/base/text.h"

namespace nadir::sim {
namespace {

constexpr ParameterRange mass_range = {0, 1e6, true, "is it in grams?"}, moment_range = {0, 1e9, true},
                         product_range = {-1e9, 1e9}, polynomial = {-10, 10},
                         motor_constant = {0, 10, true, "is it in rpm a volt? 9.549 over that is in V s/rad"},
                         resistance_range = {0, 1000, true, "is it in milliohms?"},
                         finite = {std::numeric_limits<double>::lowest(), std::numeric_limits<double>::max()};

struct NamedMoment {
  const char* name;
  double Inertia::*at;
  bool product;
};
constexpr std::array<NamedMoment, 6> moments = {{{"jxx", &Inertia::jxx_kgm2, false},
                                                 {"jyy", &Inertia::jyy_kgm2, false},
                                                 {"jzz", &Inertia::jzz_kgm2, false},
                                                 {"jxy", &Inertia::jxy_kgm2, true},
                                                 {"jxz", &Inertia::jxz_kgm2, true},
                                                 {"jyz", &Inertia::jyz_kgm2, true}}};

Inertia inertia_of(const MassProperties& mass) {
  const Eigen::Matrix3d& j = mass.inertia_kgm2();
  return {j(0, 0), j(1, 1), j(2, 2), 0 - j(0, 1), 0 - j(0, 2), 0 - j(1, 2)};  // no negative zero
}

constexpr std::array<std::string_view, 3> point_kinds = {"wheel", "skid", "part"};

struct NamedContact {
  const char* name;
  double ContactPoint::*at;
  bool of_wheels, needed;
};
constexpr std::array<NamedContact, 8> contact_numbers = {
    {{"stiffness_npm", &ContactPoint::stiffness_npm, false, true},
     {"damping_spm", &ContactPoint::damping_spm, false, true},
     {"friction", &ContactPoint::friction, false, false},
     {"rolling_friction", &ContactPoint::rolling_friction, true, false},
     {"brake_friction", &ContactPoint::brake_friction, true, false},
     {"slip_rad", &ContactPoint::slip_rad, true, false},
     {"steering", &ContactPoint::steering, true, false},
     {"most_n", &ContactPoint::most_n, false, false}}};

bool has(const ContactPoint& point, const NamedContact& number) {
  return point.kind == ContactPoint::Kind::Wheel || (point.kind == ContactPoint::Kind::Skid && !number.of_wheels);
}

void read_point(const ParameterLayer& layer, ContactPoint& point) {
  const YamlMap& yaml = layer.yaml();
  const std::size_t before = yaml.fault_count();
  const ContactPoint::Kind kind = point.kind;
  if (layer.complete()) yaml.require("kind");
  if (const auto name = yaml.text("kind"))
    if (const auto value = yaml.value_of<ContactPoint::Kind>(
            "kind", parse_name<ContactPoint::Kind>("kind of contact point", *name, point_kinds)))
      point.kind = *value;
  layer.numbers("place_m", place_range, {point.body_m.data(), 3});
  const ParameterLayer numbers(yaml, layer.complete() || kind != point.kind);
  for (const NamedContact& number : contact_numbers) {
    if (!has(point, number)) continue;
    if (number.needed)
      numbers.number(number.name, finite, point.*number.at);
    else
      numbers.optional_number(number.name, finite, point.*number.at);
  }
  note_faults(yaml, before, faults_of(point));
}

}  // namespace

void note_faults(const YamlMap& yaml, std::size_t before, std::span<const ParameterFault> faults) {
  if (yaml.fault_count() != before) return;
  for (const ParameterFault& fault : faults) yaml.fault(fault.key, fault.message);
}

bool read_mass(const ParameterLayer& layer, MassProperties& mass) {
  double kilograms = mass.mass_kg();
  Inertia inertia = inertia_of(mass);
  const std::size_t before = layer.yaml().fault_count();
  layer.number("mass_kg", mass_range, kilograms);
  if (const auto section = layer.section("inertia_kgm2"))
    for (const NamedMoment& m : moments) {
      if (m.product)
        section->optional_number(m.name, product_range, inertia.*m.at);
      else
        section->number(m.name, moment_range, inertia.*m.at);
    }
  if (layer.yaml().fault_count() != before) return false;
  const auto made = MassProperties::create(kilograms, inertia);
  if (!made) {
    layer.yaml().fault("inertia_kgm2", made.error().message);
    return false;
  }
  mass = *made;
  return true;
}

std::string mass_text(const MassProperties& mass) {
  const Inertia j = inertia_of(mass);
  return fmt::format("mass_kg: {}\ninertia_kgm2: {{jxx: {}, jyy: {}, jzz: {}, jxy: {}, jxz: {}, jyz: {}}}\n",
                     mass.mass_kg(), j.jxx_kgm2, j.jyy_kgm2, j.jzz_kgm2, j.jxy_kgm2, j.jxz_kgm2, j.jyz_kgm2);
}

void read_electric(const ParameterLayer& layer, Propulsion& motor) {
  layer.number("diameter_m", length_range, motor.diameter_m);
  std::array<double, 3> thrust = {motor.ct0, motor.ct1, motor.ct2}, torque = {motor.cq0, motor.cq1, motor.cq2};
  layer.numbers("thrust", polynomial, thrust);
  layer.numbers("torque", polynomial, torque);
  if (layer.yaml().has("torque") && !(torque[0] > 0))
    layer.yaml().fault("torque", fmt::format("expected a first number above 0, found {}: at rest a propeller needs "
                                             "torque to turn",
                                             torque[0]));
  motor.ct0 = thrust[0], motor.ct1 = thrust[1], motor.ct2 = thrust[2];
  motor.cq0 = torque[0], motor.cq1 = torque[1], motor.cq2 = torque[2];
  layer.number("kq_vspr", motor_constant, motor.kq_vspr);
  layer.number("max_voltage_v", voltage_range, motor.max_voltage_v);
  layer.number("resistance_ohm", resistance_range, motor.resistance_ohm);
  layer.number("no_load_current_a", current_range, motor.no_load_current_a);
}

std::string electric_text(const Propulsion& motor) {
  return fmt::format(
      "diameter_m: {}, thrust: [{}, {}, {}], torque: [{}, {}, {}], kq_vspr: {}, max_voltage_v: {}, resistance_ohm: {}, "
      "no_load_current_a: {}",
      motor.diameter_m, motor.ct0, motor.ct1, motor.ct2, motor.cq0, motor.cq1, motor.cq2, motor.kq_vspr,
      motor.max_voltage_v, motor.resistance_ohm, motor.no_load_current_a);
}

void read_gear(const ParameterLayer& layer, std::optional<ContactGear>& gear) {
  const auto section = layer.optional_section("gear");
  if (!section) return;
  const std::size_t before = layer.yaml().fault_count();
  std::vector<ContactPoint> points;
  if (gear) points = gear->points();
  for (const auto& [name, entry] : section->yaml().entries()) {
    const NamedPart point(points, name, ContactPoint{});
    read_point(ParameterLayer(entry, point.added), *point.part);
  }
  if (layer.yaml().fault_count() != before) return;
  if (const auto made = layer.yaml().value_of<ContactGear>("gear", ContactGear::create(std::move(points))))
    gear = *made;
}

std::string gear_text(const ContactGear& gear) {
  std::string text = "gear:\n";
  for (const ContactPoint& point : gear.points()) {
    text += fmt::format("  {}: {{kind: {}, place_m: [{}, {}, {}]", yaml_quoted(point.name),
                        point_kinds[static_cast<std::size_t>(point.kind)], point.body_m.x(), point.body_m.y(),
                        point.body_m.z());
    for (const NamedContact& number : contact_numbers)
      if (has(point, number)) text += fmt::format(", {}: {}", number.name, point.*number.at);
    text += "}\n";
  }
  return text;
}

void warn_of_gear(const ContactGear& gear, double mass_kg, std::vector<std::string>& warnings) {
  double stiffness_npm = 0, first_m = -1e9, last_m = 1e9;
  for (const ContactPoint& p : gear.points()) {
    if (p.kind == ContactPoint::Kind::Part) continue;
    stiffness_npm += p.stiffness_npm;
    first_m = std::max(first_m, p.body_m.x()), last_m = std::min(last_m, p.body_m.x());
  }
  if (stiffness_npm == 0) return;
  const double height_m = standing_height_m(gear);
  if (first_m <= 0 || last_m >= 0)
    warnings.push_back(
        fmt::format("tips over on the ground: all wheels and skids of its gear lie {} its centre of mass",
                    first_m <= 0 ? "behind" : "in front of"));
  if (const double give_m = mass_kg * 9.81 / stiffness_npm; give_m > height_m / 2)
    warnings.push_back(
        fmt::format("soft on the ground: its gear gives by {:.2g} m under its weight, and reaches {} m "
                    "down",
                    give_m, height_m));
}

}  // namespace nadir::sim

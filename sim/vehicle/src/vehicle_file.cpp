#include "nadir/sim/vehicle_file.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "nadir/base/files.h"
#include "nadir/base/text.h"
#include "nadir/sim/parameter_layer.h"
#include "vehicle_models.h"

namespace nadir::sim {
namespace {

// Bounds of what a number can be in its unit: outside them a unit is mistaken, not the vehicle unusual.
constexpr ParameterRange mass_kg = {0, 1e6, true, "is it in grams?"}, moment_kgm2 = {0, 1e9, true},
                         product_kgm2 = {-1e9, 1e9}, length_m = {0, 100, true, "is it in millimetres?"},
                         area_m2 = {0, 2000, true, "is it in square centimetres?"}, efficiency = {0, 1.5, true},
                         angle_rad = {0, 1.5, true, "is it in degrees?"},
                         sharpness_per_rad = {10, 150, false, "is it for degrees?"}, derivative = {-1000, 1000},
                         airspeed_mps = {0, 400, true, "is it in kilometres an hour?"}, polynomial = {-10, 10},
                         motor_constant = {0, 10, true, "is it in rpm a volt? 9.549 over that is in V s/rad"},
                         voltage_v = {0, 2000, true}, resistance_ohm = {0, 1000, true, "is it in milliohms?"},
                         current_a = {0, 1000}, slipstream_mps = {0, 400, true}, torque_nm = {0, 1e5},
                         lag_s = {0, 5, false, "is it in milliseconds?"};

constexpr std::array<std::string_view, 2> stall_model_names = {"lift", "airframe"};

struct NamedCoefficient {
  const char* name;
  Coefficient FixedWing::*at;
};
constexpr std::array<NamedCoefficient, 6> coefficients = {{{"lift", &FixedWing::lift},
                                                           {"drag", &FixedWing::drag},
                                                           {"side", &FixedWing::side},
                                                           {"roll", &FixedWing::roll},
                                                           {"pitch", &FixedWing::pitch},
                                                           {"yaw", &FixedWing::yaw}}};
struct NamedCause {
  const char* name;
  double Coefficient::*at;
};
constexpr std::array<NamedCause, 9> causes = {{{"zero", &Coefficient::zero},
                                               {"alpha", &Coefficient::alpha},
                                               {"beta", &Coefficient::beta},
                                               {"p", &Coefficient::p},
                                               {"q", &Coefficient::q},
                                               {"r", &Coefficient::r},
                                               {"elevator", &Coefficient::elevator},
                                               {"aileron", &Coefficient::aileron},
                                               {"rudder", &Coefficient::rudder}}};

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
  return {j(0, 0), j(1, 1), j(2, 2), -j(0, 1), -j(0, 2), -j(1, 2)};
}

/// False where it has faults.
bool read_mass(const ParameterLayer& layer, MassProperties& mass) {
  double kilograms = mass.mass_kg();
  Inertia inertia = inertia_of(mass);
  const std::size_t before = layer.yaml().fault_count();
  layer.number("mass_kg", mass_kg, kilograms);
  if (const auto section = layer.section("inertia_kgm2"))
    for (const NamedMoment& m : moments) {
      if (m.product)
        section->optional_number(m.name, product_kgm2, inertia.*m.at);
      else
        section->number(m.name, moment_kgm2, inertia.*m.at);
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

void read_electric(const ParameterLayer& layer, Propulsion& motor) {
  layer.number("diameter_m", length_m, motor.diameter_m);
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
  layer.number("max_voltage_v", voltage_v, motor.max_voltage_v);
  layer.number("resistance_ohm", resistance_ohm, motor.resistance_ohm);
  layer.number("no_load_current_a", current_a, motor.no_load_current_a);
}

void read_slipstream(const ParameterLayer& layer, Slipstream& slipstream) {
  layer.number("area_m2", area_m2, slipstream.area_m2);
  layer.number("coefficient", {0, 10, true}, slipstream.coefficient);
  layer.number("full_speed_mps", slipstream_mps, slipstream.full_speed_mps);
  layer.number("full_torque_nm", torque_nm, slipstream.full_torque_nm);
}

/// A layer that changes some parameters of the kind that is there may leave out the others; another kind needs all.
template <class Kind, class Read>
void read_kind(const ParameterLayer& layer, std::string_view key, FixedWingPropulsion& propulsion, Read&& read) {
  const auto yaml = layer.yaml().map(key);
  if (!yaml) return;
  const bool same = std::holds_alternative<Kind>(propulsion);
  Kind kind = same ? std::get<Kind>(propulsion) : Kind{};
  read(ParameterLayer(*yaml, layer.complete() || !same), kind);
  propulsion = kind;
}

void read_propulsion(const ParameterLayer& layer, FixedWingPropulsion& propulsion) {
  const YamlMap& yaml = layer.yaml();
  const bool electric = yaml.has("electric"), slipstream = yaml.has("slipstream");
  if (electric && slipstream)
    yaml.fault("slipstream", "expected it or electric, found both");
  else if (electric)
    read_kind<Propulsion>(layer, "electric", propulsion, read_electric);
  else if (slipstream)
    read_kind<Slipstream>(layer, "slipstream", propulsion, read_slipstream);
  else if (layer.complete())
    yaml.require("electric");
}

void read_wing(const ParameterLayer& layer, FixedWing& vehicle) {
  layer.number("area_m2", area_m2, vehicle.wing_area_m2);
  layer.number("span_m", length_m, vehicle.span_m);
  layer.number("chord_m", length_m, vehicle.chord_m);
  layer.optional_number("oswald", efficiency, vehicle.oswald);
}

void read_stall(const ParameterLayer& layer, FixedWing& vehicle) {
  layer.number("alpha_rad", angle_rad, vehicle.stall_alpha_rad);
  layer.number("sharpness_per_rad", sharpness_per_rad, vehicle.stall_sharpness);
  if (const auto name = layer.yaml().text("model")) {
    const auto model = parse_name<StallModel>("stall model", *name, stall_model_names);
    if (const auto value = layer.yaml().value_of<StallModel>("model", model)) vehicle.stall_model = *value;
  }
}

void read_coefficients(const ParameterLayer& layer, FixedWing& vehicle) {
  for (const NamedCoefficient& coefficient : coefficients)
    if (const auto section = layer.section(coefficient.name))
      for (const NamedCause& cause : causes)
        section->optional_number(cause.name, derivative, vehicle.*coefficient.at.*cause.at);
}

void check_geometry(const YamlMap& yaml, const FixedWing& vehicle) {
  const double span = vehicle.span_m, chord = vehicle.chord_m, filled = vehicle.wing_area_m2 / (span * chord);
  if (chord > span)
    yaml.fault("wing", fmt::format("expected a chord of at most the span, found {} m and {} m", chord, span));
  else if (!(filled >= 0.25 && filled <= 2))
    yaml.fault("wing", fmt::format("expected an area near span times chord, {:.4g} m^2, found {} m^2", span * chord,
                                   vehicle.wing_area_m2));
}

void check_gyration(const YamlMap& yaml, const FixedWing& vehicle) {
  const double gyration_m = std::sqrt(vehicle.mass.inertia_kgm2()(0, 0) / vehicle.mass.mass_kg());
  if (gyration_m > vehicle.span_m / 2)
    yaml.fault("inertia_kgm2",
               fmt::format("expected mass within the span of {} m, found a radius of gyration of {:.4g} m about the x "
                           "axis: are they in kg and kg m^2?",
                           vehicle.span_m, gyration_m));
}

/// Signs without which nothing can fly by the conventions of `FixedWing`.
void check_signs(const YamlMap& yaml, const FixedWing& vehicle) {
  const auto expect = [&](bool good, std::string_view key, std::string_view expected, double found,
                          std::string_view help = {}) {
    if (!good)
      yaml.fault("coefficients",
                 fmt::format("{}: expected {}, found {}{}{}", key, expected, found, help.empty() ? "" : ": ", help));
  };
  const double slope = vehicle.lift.alpha;
  expect(slope > 0, "lift.alpha", "more than 0", slope, "lift rises with alpha");
  expect(slope <= 0 || slope >= 0.3, "lift.alpha", "about 3 to 6 per radian", slope, "is it per degree?");
  expect(vehicle.drag.zero >= 0, "drag.zero", "at least 0", vehicle.drag.zero);
  expect(vehicle.roll.p <= 0, "roll.p", "at most 0", vehicle.roll.p, "it damps");
  expect(vehicle.pitch.q <= 0, "pitch.q", "at most 0", vehicle.pitch.q, "it damps");
  expect(vehicle.yaw.r <= 0, "yaw.r", "at most 0", vehicle.yaw.r, "it damps");
  expect(vehicle.pitch.elevator < 0, "pitch.elevator", "less than 0", vehicle.pitch.elevator,
         "a positive elevator pushes the nose down; turn the signs of all that it does");
  expect(vehicle.roll.aileron > 0, "roll.aileron", "more than 0", vehicle.roll.aileron,
         "a positive aileron rolls right; turn the signs of all that it does");
  expect(vehicle.yaw.rudder < 0, "yaw.rudder", "less than 0", vehicle.yaw.rudder,
         "a positive rudder turns the nose left; turn the signs of all that it does");
}

/// Takes the parameters of a layer into `vehicle`; false where the layer has faults. What numbers mean together is
/// checked where each of them can be.
bool apply(const ParameterLayer& layer, FixedWing& vehicle) {
  const YamlMap& yaml = layer.yaml();
  const std::size_t before = yaml.fault_count();
  const auto good = [&](std::string_view key, auto&& read) {
    const std::size_t faults = yaml.fault_count();
    if (const auto section = layer.section(key)) read(*section);
    return yaml.fault_count() == faults;
  };
  if (layer.complete()) yaml.require("kind");
  if (const auto kind = yaml.text("kind"); kind && *kind != "fixed_wing")
    yaml.fault("kind", fmt::format("expected fixed_wing, found '{}'", *kind));
  layer.number("cruise_mps", airspeed_mps, vehicle.cruise_mps);
  const bool mass_good = read_mass(layer, vehicle.mass);
  const bool wing_good = good("wing", [&](const ParameterLayer& wing) { read_wing(wing, vehicle); });
  good("stall", [&](const ParameterLayer& stall) { read_stall(stall, vehicle); });
  const bool coefficients_good =
      good("coefficients", [&](const ParameterLayer& section) { read_coefficients(section, vehicle); });
  good("propulsion", [&](const ParameterLayer& section) { read_propulsion(section, vehicle.propulsion); });
  good("servos", [&](const ParameterLayer& servos) {
    servos.number("time_constant_s", lag_s, vehicle.servo_time_constant_s);
    servos.number("max_deflection_rad", angle_rad, vehicle.max_deflection_rad);
  });
  if (wing_good) check_geometry(yaml, vehicle);
  if (wing_good && mass_good) check_gyration(yaml, vehicle);
  if (coefficients_good) check_signs(yaml, vehicle);
  return yaml.fault_count() == before;
}

std::optional<FixedWing> read_upon_base(const YamlMap& yaml) {
  FixedWing vehicle;
  const auto name = yaml.text("base");
  if (name) {
    const auto base = yaml.value_of<FixedWing>("base", vehicle_model(*name));
    if (!base) return std::nullopt;
    vehicle = *base;
  }
  if (!apply(ParameterLayer(yaml, !name), vehicle)) return std::nullopt;
  return vehicle;
}

}  // namespace

std::vector<std::string_view> vehicle_models() {
  std::vector<std::string_view> names;
  for (const VehicleModelText& model : vehicle_model_texts()) names.push_back(model.name);
  return names;
}

Result<FixedWing> vehicle_model(std::string_view name) {
  for (const VehicleModelText& model : vehicle_model_texts())
    if (model.name == name) return parse_vehicle(std::string(name), std::string(model.yaml));
  return fail(Error::Kind::NotFound, fmt::format("no model '{}'{}", name, suggestion(name, vehicle_models())));
}

std::optional<FixedWing> read_vehicle(const YamlMap& yaml, const std::filesystem::path& folder) {
  const auto file = yaml.text("file");
  if (!file) return read_upon_base(yaml);
  if (yaml.has("base")) yaml.fault("base", "expected it or file, found both");
  auto vehicle = yaml.value_of<FixedWing>("file", read_vehicle_file((folder / *file).lexically_normal()));
  if (!vehicle || !apply(ParameterLayer(yaml, false), *vehicle)) return std::nullopt;
  return vehicle;
}

Result<FixedWing> parse_vehicle(const std::string& file_name, const std::string& text) {
  const auto yaml = YamlMap::parse(file_name, text);
  if (!yaml) return fail(yaml);
  const auto vehicle = read_upon_base(*yaml);
  if (auto ok = yaml->finish(); !ok) return fail(ok);
  return *vehicle;
}

Result<FixedWing> read_vehicle_file(const std::filesystem::path& path) {
  const auto text = read_text_file(path);
  if (!text) return fail(text);
  return parse_vehicle(path.string(), *text);
}

std::vector<std::string> vehicle_warnings(const FixedWing& vehicle) {
  std::vector<std::string> warnings;
  if (vehicle.pitch.alpha > 0)
    warnings.push_back(
        fmt::format("unstable in pitch: pitch.alpha is {}, so its centre of mass lies {:.2g} chords "
                    "behind its neutral point",
                    vehicle.pitch.alpha, vehicle.pitch.alpha / vehicle.lift.alpha));
  if (vehicle.yaw.beta < 0)
    warnings.push_back(
        fmt::format("unstable in yaw: yaw.beta is {}, so its nose turns out of the wind", vehicle.yaw.beta));
  if (vehicle.roll.beta > 0)
    warnings.push_back(fmt::format("rolls into a side-slip: roll.beta is {}, a wing that droops; its spiral grows",
                                   vehicle.roll.beta));
  if (vehicle.drag.zero == 0) warnings.push_back("no parasitic drag: drag.zero is 0");
  return warnings;
}

std::string to_yaml(const FixedWing& vehicle, std::string_view indent) {
  std::string text;
  const auto line = [&](const std::string& content) { text += fmt::format("{}{}\n", indent, content); };
  line("kind: fixed_wing");
  line(fmt::format("cruise_mps: {}", vehicle.cruise_mps));
  line(fmt::format("mass_kg: {}", vehicle.mass.mass_kg()));
  const Inertia j = inertia_of(vehicle.mass);
  line(fmt::format("inertia_kgm2: {{jxx: {}, jyy: {}, jzz: {}, jxy: {}, jxz: {}, jyz: {}}}", j.jxx_kgm2, j.jyy_kgm2,
                   j.jzz_kgm2, j.jxy_kgm2, j.jxz_kgm2, j.jyz_kgm2));
  line(fmt::format("wing: {{area_m2: {}, span_m: {}, chord_m: {}, oswald: {}}}", vehicle.wing_area_m2, vehicle.span_m,
                   vehicle.chord_m, vehicle.oswald));
  line(fmt::format("stall: {{alpha_rad: {}, sharpness_per_rad: {}, model: {}}}", vehicle.stall_alpha_rad,
                   vehicle.stall_sharpness, stall_model_names[static_cast<std::size_t>(vehicle.stall_model)]));
  line("coefficients:");
  for (const NamedCoefficient& coefficient : coefficients) {
    std::string values;
    for (const NamedCause& cause : causes)
      values += fmt::format("{}{}: {}", values.empty() ? "" : ", ", cause.name, vehicle.*coefficient.at.*cause.at);
    line(fmt::format("  {}: {{{}}}", coefficient.name, values));
  }
  line("propulsion:");
  if (const auto* m = std::get_if<Propulsion>(&vehicle.propulsion))
    line(
        fmt::format("  electric: {{diameter_m: {}, thrust: [{}, {}, {}], torque: [{}, {}, {}], kq_vspr: {}, "
                    "max_voltage_v: {}, resistance_ohm: {}, no_load_current_a: {}}}",
                    m->diameter_m, m->ct0, m->ct1, m->ct2, m->cq0, m->cq1, m->cq2, m->kq_vspr, m->max_voltage_v,
                    m->resistance_ohm, m->no_load_current_a));
  else if (const auto* s = std::get_if<Slipstream>(&vehicle.propulsion))
    line(fmt::format("  slipstream: {{area_m2: {}, coefficient: {}, full_speed_mps: {}, full_torque_nm: {}}}",
                     s->area_m2, s->coefficient, s->full_speed_mps, s->full_torque_nm));
  line(fmt::format("servos: {{time_constant_s: {}, max_deflection_rad: {}}}", vehicle.servo_time_constant_s,
                   vehicle.max_deflection_rad));
  return text;
}

}  // namespace nadir::sim

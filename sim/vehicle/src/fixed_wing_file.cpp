#include <fmt/format.h>

#include <array>
#include <cmath>

#include "nadir/base/text.h"
#include "parameter_sections.h"
#include "vehicle_kinds.h"

namespace nadir::sim {
namespace {

constexpr ParameterRange area_range = {0, 2000, true, "is it in square centimetres?"}, efficiency = {0, 1.5, true},
                         angle_range = {0, 1.5, true, "is it in degrees?"},
                         sharpness_range = {10, 150, false, "is it for degrees?"}, derivative = {-1000, 1000},
                         airspeed_range = {0, 400, true, "is it in kilometres an hour?"}, speed_range = {0, 400, true},
                         torque_range = {0, 1e5};

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

void read_slipstream(const ParameterLayer& layer, Slipstream& slipstream) {
  layer.number("area_m2", area_range, slipstream.area_m2);
  layer.number("coefficient", {0, 10, true}, slipstream.coefficient);
  layer.number("full_speed_mps", speed_range, slipstream.full_speed_mps);
  layer.number("full_torque_nm", torque_range, slipstream.full_torque_nm);
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
  layer.number("area_m2", area_range, vehicle.wing_area_m2);
  layer.number("span_m", length_range, vehicle.span_m);
  layer.number("chord_m", length_range, vehicle.chord_m);
  layer.optional_number("oswald", efficiency, vehicle.oswald);
}

void read_stall(const ParameterLayer& layer, FixedWing& vehicle) {
  layer.number("alpha_rad", angle_range, vehicle.stall_alpha_rad);
  layer.number("sharpness_per_rad", sharpness_range, vehicle.stall_sharpness);
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

}  // namespace

void apply(const ParameterLayer& layer, FixedWing& vehicle) {
  const YamlMap& yaml = layer.yaml();
  const auto good = [&](std::string_view key, auto&& read) {
    const std::size_t faults = yaml.fault_count();
    if (const auto section = layer.section(key)) read(*section);
    return yaml.fault_count() == faults;
  };
  layer.number("cruise_mps", airspeed_range, vehicle.cruise_mps);
  const bool mass_good = read_mass(layer, vehicle.mass);
  const bool wing_good = good("wing", [&](const ParameterLayer& wing) { read_wing(wing, vehicle); });
  good("stall", [&](const ParameterLayer& stall) { read_stall(stall, vehicle); });
  const bool coefficients_good =
      good("coefficients", [&](const ParameterLayer& section) { read_coefficients(section, vehicle); });
  good("propulsion", [&](const ParameterLayer& section) { read_propulsion(section, vehicle.propulsion); });
  good("servos", [&](const ParameterLayer& servos) {
    servos.number("time_constant_s", lag_range, vehicle.servo_time_constant_s);
    servos.number("max_deflection_rad", angle_range, vehicle.max_deflection_rad);
  });
  read_gear(layer, vehicle.gear);
  if (wing_good) check_geometry(yaml, vehicle);
  if (wing_good && mass_good) check_gyration(yaml, vehicle);
  if (coefficients_good) check_signs(yaml, vehicle);
}

std::vector<std::string> warnings_of(const FixedWing& vehicle) {
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
  if (vehicle.gear) warn_of_gear(*vehicle.gear, vehicle.mass.mass_kg(), warnings);
  return warnings;
}

std::string text_of(const FixedWing& vehicle) {
  std::string text = fmt::format("cruise_mps: {}\n", vehicle.cruise_mps) + mass_text(vehicle.mass);
  text += fmt::format("wing: {{area_m2: {}, span_m: {}, chord_m: {}, oswald: {}}}\n", vehicle.wing_area_m2,
                      vehicle.span_m, vehicle.chord_m, vehicle.oswald);
  text += fmt::format("stall: {{alpha_rad: {}, sharpness_per_rad: {}, model: {}}}\n", vehicle.stall_alpha_rad,
                      vehicle.stall_sharpness, stall_model_names[static_cast<std::size_t>(vehicle.stall_model)]);
  text += "coefficients:\n";
  for (const NamedCoefficient& coefficient : coefficients) {
    std::string values;
    for (const NamedCause& cause : causes)
      values += fmt::format("{}{}: {}", values.empty() ? "" : ", ", cause.name, vehicle.*coefficient.at.*cause.at);
    text += fmt::format("  {}: {{{}}}\n", coefficient.name, values);
  }
  text += "propulsion:\n";
  if (const auto* m = std::get_if<Propulsion>(&vehicle.propulsion))
    text += fmt::format("  electric: {{{}}}\n", electric_text(*m));
  else if (const auto* s = std::get_if<Slipstream>(&vehicle.propulsion))
    text += fmt::format("  slipstream: {{area_m2: {}, coefficient: {}, full_speed_mps: {}, full_torque_nm: {}}}\n",
                        s->area_m2, s->coefficient, s->full_speed_mps, s->full_torque_nm);
  text += fmt::format("servos: {{time_constant_s: {}, max_deflection_rad: {}}}\n", vehicle.servo_time_constant_s,
                      vehicle.max_deflection_rad);
  if (vehicle.gear) text += gear_text(*vehicle.gear);
  return text;
}

}  // namespace nadir::sim

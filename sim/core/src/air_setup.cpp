#include "nadir/sim/air_setup.h"

#include <fmt/format.h>

#include <array>
#include <vector>

#include "nadir/base/text.h"
#include "read_yaml.h"

namespace nadir::sim {
namespace {

// Beyond these a unit is mistaken: the fastest wind ever measured near the ground is 113 m/s, the fastest jet stream
// 180.
constexpr double most_wind_mps = 200, most_vertical_mps = 50;

constexpr std::array<std::string_view, 3> law_names = {"none", "power", "logarithmic"};

Result<Shear::Law> parse_law(std::string_view name) { return parse_name<Shear::Law>("law of shear", name, law_names); }

Shear read_shear(const YamlMap& yaml) {
  Shear shear;
  yaml.require("law");
  take(parsed<Shear::Law>(yaml, "law", parse_law), shear.law);
  take_positive(yaml, "reference_m", shear.reference_m);
  take_positive(yaml, "top_m", shear.top_m);
  take_within(yaml, "exponent", 0, 1, shear.exponent);
  take_positive(yaml, "roughness_m", shear.roughness_m);
  if (shear.law == Shear::Law::Logarithmic && shear.roughness_m >= shear.reference_m)
    yaml.fault("roughness_m",
               fmt::format("expected less than reference_m, {}, found {}", shear.reference_m, shear.roughness_m));
  if (shear.top_m < shear.reference_m)
    yaml.fault("top_m", fmt::format("expected at least reference_m, {}, found {}", shear.reference_m, shear.top_m));
  return shear;
}

Gust read_gust(const YamlMap& yaml) {
  Gust gust;
  for (const char* key : {"start_s", "speed_mps", "gradient_m", "towards"}) yaml.require(key);
  if (const auto start = yaml.number("start_s")) {
    if (!(*start >= 0)) yaml.fault("start_s", fmt::format("expected a time from 0, found {}", *start));
    gust.start_s = *start;
  }
  take_within(yaml, "speed_mps", 0, most_vertical_mps, gust.speed_mps);
  take_positive(yaml, "gradient_m", gust.gradient_m);
  take(parsed<Gust::Shape>(yaml, "shape", parse_gust_shape), gust.shape);
  take(parsed<Gust::Towards>(yaml, "towards", parse_gust_towards), gust.towards);
  return gust;
}

TurbulenceSetup read_turbulence(const YamlMap& yaml) {
  TurbulenceSetup turbulence;
  turbulence.intensity = parsed<TurbulenceIntensity>(yaml, "intensity", parse_turbulence_intensity);
  take_within(yaml, "wind_at_20ft_mps", 0, most_wind_mps, turbulence.wind_mps);
  const bool named = yaml.has("intensity"), measured = yaml.has("wind_at_20ft_mps");
  if (named && measured) yaml.fault("wind_at_20ft_mps", "expected it or intensity, found both");
  if (!named && !measured) yaml.require("intensity");
  return turbulence;
}

AtmosphereOffsets read_atmosphere(const YamlMap& yaml) {
  AtmosphereOffsets offsets;
  take(yaml.number("temperature_offset_k"), offsets.temperature_k);
  take(yaml.number("pressure_offset_pa"), offsets.pressure_pa);
  if (const auto ok = Atmosphere::check({.temperature_k = offsets.temperature_k}); !ok)
    yaml.fault("temperature_offset_k", ok.error().message);
  if (const auto ok = Atmosphere::check({.pressure_pa = offsets.pressure_pa}); !ok)
    yaml.fault("pressure_offset_pa", ok.error().message);
  return offsets;
}

FieldSetup read_field(const YamlMap& yaml) {
  FieldSetup field;
  yaml.require("map");
  take(yaml.text("map"), field.map);
  take(yaml.texts("bands"), field.bands);
  if (yaml.has("bands") && field.bands.size() != 2)
    yaml.fault("bands", fmt::format("expected two, wind towards east and towards north, found {}", field.bands.size()));
  take(parsed<MapWind::Outside>(yaml, "outside", parse_outside), field.outside);
  return field;
}

std::string gust_text(const Gust& gust) {
  return fmt::format("    - {{start_s: {}, speed_mps: {}, gradient_m: {}, shape: {}, towards: {}}}\n", gust.start_s,
                     gust.speed_mps, gust.gradient_m, to_string(gust.shape), to_string(gust.towards));
}

}  // namespace

AirSetup read_air(const YamlMap& yaml) {
  AirSetup air;
  if (const auto wind = yaml.map("wind")) {
    for (const char* key : {"from_deg", "speed_mps"}) wind->require(key);
    take_within(*wind, "from_deg", -360, 360, air.wind_from_deg);
    take_within(*wind, "speed_mps", 0, most_wind_mps, air.wind_speed_mps);
    take_within(*wind, "up_mps", -most_vertical_mps, most_vertical_mps, air.wind_up_mps);
  }
  if (const auto shear = yaml.map("shear")) air.shear = read_shear(*shear);
  for (const YamlMap& gust : yaml.maps("gusts")) air.gusts.push_back(read_gust(gust));
  if (const auto turbulence = yaml.map("turbulence")) air.turbulence = read_turbulence(*turbulence);
  if (const auto atmosphere = yaml.map("atmosphere")) air.atmosphere = read_atmosphere(*atmosphere);
  if (const auto field = yaml.map("field")) air.field = read_field(*field);
  return air;
}

std::string air_text(const AirSetup& air, const std::string& field_path) {
  std::string text = fmt::format("air:\n  wind: {{from_deg: {}, speed_mps: {}, up_mps: {}}}\n", air.wind_from_deg,
                                 air.wind_speed_mps, air.wind_up_mps);
  const Shear& shear = air.shear;
  text += fmt::format("  shear: {{law: {}, reference_m: {}, exponent: {}, roughness_m: {}, top_m: {}}}\n",
                      law_names[static_cast<std::size_t>(shear.law)], shear.reference_m, shear.exponent,
                      shear.roughness_m, shear.top_m);
  if (!air.gusts.empty()) text += "  gusts:\n";
  for (const Gust& gust : air.gusts) text += gust_text(gust);
  if (air.turbulence && air.turbulence->intensity)
    text += fmt::format("  turbulence: {{intensity: {}}}\n", to_string(*air.turbulence->intensity));
  else if (air.turbulence)
    text += fmt::format("  turbulence: {{wind_at_20ft_mps: {}}}\n", air.turbulence->wind_mps);
  text += fmt::format("  atmosphere: {{temperature_offset_k: {}, pressure_offset_pa: {}}}\n",
                      air.atmosphere.temperature_k, air.atmosphere.pressure_pa);
  if (air.field) {
    text += fmt::format("  field: {{map: {}", yaml_quoted(field_path));
    for (std::size_t i = 0; i < air.field->bands.size(); ++i)
      text += fmt::format("{}{}{}", i ? ", " : ", bands: [", yaml_quoted(air.field->bands[i]),
                          i + 1 == air.field->bands.size() ? "]" : "");
    text += fmt::format(", outside: {}}}\n", to_string(air.field->outside));
  }
  return text;
}

}  // namespace nadir::sim

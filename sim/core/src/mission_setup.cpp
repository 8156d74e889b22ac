#include "nadir/sim/mission_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nadir/base/text.h"
#include "read_yaml.h"

namespace nadir::sim {
namespace {

using geodesy::TypedHeight;

/// Two rising numbers above zero, or one for both.
void take_range(const YamlMap& yaml, std::string_view key, std::pair<double, double>& out) {
  if (!yaml.has(key)) return;
  const auto values = yaml.numbers(key);
  if (!values) return;
  if (values->size() != 2 || !((*values)[0] > 0 && (*values)[0] <= (*values)[1]))
    yaml.fault(key, "expected two rising numbers above 0 such as [100, 250]");
  else
    out = {(*values)[0], (*values)[1]};
}

/// A number above zero that has to be there.
void take_needed(const YamlMap& yaml, std::string_view key, double& out) {
  yaml.require(key);
  take_positive(yaml, key, out);
}

TypedHeight read_height(const YamlMap& yaml, const TypedHeight& otherwise) {
  return parsed<TypedHeight>(yaml, "height", geodesy::parse_height).value_or(otherwise);
}

WaypointSetup read_position(const YamlMap& yaml, const TypedHeight& height) {
  WaypointSetup point;
  if (!yaml.has("lat_deg") && !yaml.has("lon_deg"))
    for (const char* key : {"north_m", "east_m"}) yaml.require(key);
  point.place = read_place(yaml);
  point.height = read_height(yaml, height);
  return point;
}

WaypointSetup read_waypoint(const YamlMap& yaml, const TypedHeight& height) {
  WaypointSetup point = read_position(yaml, height);
  point.course_deg = yaml.number("course_deg");
  point.turn_radius_m = yaml.number("turn_radius_m");
  if (point.turn_radius_m && !(*point.turn_radius_m >= 0))
    yaml.fault("turn_radius_m", fmt::format("expected a number from 0, found {}", *point.turn_radius_m));
  point.airspeed_mps = positive(yaml, "airspeed_mps");
  return point;
}

OrbitSetup read_orbit(const YamlMap& yaml, const TypedHeight& height) {
  OrbitSetup orbit;
  orbit.center = read_place(yaml);
  orbit.height = read_height(yaml, height);
  take_needed(yaml, "radius_m", orbit.radius_m);
  if (const auto direction = yaml.text("direction")) {
    orbit.clockwise = *direction == "right";
    if (*direction != "right" && *direction != "left")
      yaml.fault("direction", fmt::format("expected right (clockwise) or left, found '{}'", *direction));
  }
  orbit.turns = positive(yaml, "turns");
  orbit.duration_s = positive(yaml, "duration_s");
  if (orbit.turns && orbit.duration_s) yaml.fault("turns", "expected it or duration_s, found both");
  orbit.airspeed_mps = positive(yaml, "airspeed_mps");
  return orbit;
}

AreaSetup read_area(const YamlMap& yaml) {
  static constexpr std::array<const char*, 3> shapes = {"polygon", "rectangle", "circle"};
  int there = 0;
  for (const char* shape : shapes) there += yaml.has(shape);
  if (there == 0) yaml.require("polygon");
  if (there > 1) yaml.fault(yaml.has("polygon") ? "polygon" : "rectangle", "expected one area, found several");

  std::vector<PlaceSetup> corners;
  for (const YamlMap& corner : yaml.maps("polygon")) corners.push_back(read_place(corner));
  if (yaml.has("polygon") && corners.size() < 3)
    yaml.fault("polygon", fmt::format("expected at least three corners such as [{{north_m: 0, east_m: 0}}, ...], "
                                      "found {}",
                                      corners.size()));
  if (const auto map = yaml.map("rectangle")) {
    RectangleSetup rectangle{read_place(*map)};
    take_needed(*map, "length_m", rectangle.length_m);
    take_needed(*map, "width_m", rectangle.width_m);
    take(map->number("heading_deg"), rectangle.heading_deg);
    return rectangle;
  }
  if (const auto map = yaml.map("circle")) {
    DiscSetup disc{read_place(*map)};
    take_needed(*map, "radius_m", disc.radius_m);
    return disc;
  }
  return corners;
}

SurveySetup read_survey(const YamlMap& yaml, const TypedHeight& height, std::span<const std::string_view> sensors) {
  SurveySetup survey;
  survey.area = read_area(yaml);
  survey.height = read_height(yaml, height);
  yaml.require("sensor");
  if (const auto sensor = yaml.text("sensor")) {
    if (std::find(sensors.begin(), sensors.end(), *sensor) == sensors.end())
      yaml.fault("sensor", fmt::format("no sensor '{}' of the vehicle{}", *sensor, suggestion(*sensor, sensors)));
    survey.sensor = *sensor;
  }
  take_within(yaml, "forward_overlap", 0, 0.95, survey.forward_overlap);
  take_within(yaml, "side_overlap", 0, 0.95, survey.side_overlap);
  survey.heading_deg = yaml.number("heading_deg");
  return survey;
}

void read_leads(const YamlMap& yaml, SurveySetup& survey) {
  take_within(yaml, "lead_in_m", 0, 1e6, survey.lead_in_m);
  take_within(yaml, "lead_out_m", 0, 1e6, survey.lead_out_m);
}

RandomPathSetup read_random(const YamlMap& yaml, const TypedHeight& height, double turn_radius_m) {
  RandomPathSetup random;
  random.area = read_area(yaml);
  random.heights = {height, height};
  if (const auto texts = yaml.texts("heights")) {
    if (texts->size() != 2) {
      yaml.fault("heights", "expected two such as [100 agl, 250 agl]");
    } else {
      take(yaml.value_of<TypedHeight>("heights", geodesy::parse_height((*texts)[0])), random.heights.first);
      take(yaml.value_of<TypedHeight>("heights", geodesy::parse_height((*texts)[1])), random.heights.second);
    }
  }
  random.turn_radius_m = {turn_radius_m, turn_radius_m};
  take_range(yaml, "turn_radius_m", random.turn_radius_m);
  if (yaml.has("airspeed_mps")) take_range(yaml, "airspeed_mps", random.airspeed_mps.emplace());
  take_within(yaml, "max_slope", 0, 1, random.max_slope);
  take_within(yaml, "margin_m", 0, 1e6, random.margin_m);
  random.length_m = positive(yaml, "length_m");
  return random;
}

/// What an item leaves the next one its height.
TypedHeight height_after(const MissionItemSetup& item) {
  return std::visit(
      [](const auto& what) -> TypedHeight {
        if constexpr (std::is_same_v<std::decay_t<decltype(what)>, RandomPathSetup>)
          return what.heights.first;
        else
          return what.height;
      },
      item.what);
}

std::string area_text(const AreaSetup& area) {
  if (const auto* rectangle = std::get_if<RectangleSetup>(&area))
    return fmt::format("rectangle: {{{}, length_m: {}, width_m: {}, heading_deg: {}}}", place_text(rectangle->center),
                       rectangle->length_m, rectangle->width_m, rectangle->heading_deg);
  if (const auto* disc = std::get_if<DiscSetup>(&area))
    return fmt::format("circle: {{{}, radius_m: {}}}", place_text(disc->center), disc->radius_m);
  std::vector<std::string> corners;
  for (const PlaceSetup& corner : std::get<std::vector<PlaceSetup>>(area))
    corners.push_back(fmt::format("{{{}}}", place_text(corner)));
  return fmt::format("polygon: [{}]", fmt::join(corners, ", "));
}

std::string optional_text(const char* key, std::optional<double> value) {
  return value ? fmt::format(", {}: {}", key, *value) : "";
}

std::string text(const WaypointSetup& w) {
  return fmt::format("{}, height: {}{}{}{}{}{}{}", place_text(w.place), height_text(w.height),
                     optional_text("course_deg", w.course_deg), optional_text("turn_radius_m", w.turn_radius_m),
                     optional_text("airspeed_mps", w.airspeed_mps), optional_text("hold_s", w.hold_s),
                     optional_text("yaw_deg", w.yaw_deg), optional_text("speed_mps", w.speed_mps));
}
std::string text(const OrbitSetup& o) {
  return fmt::format("orbit: {{{}, height: {}, radius_m: {}, direction: {}{}{}{}}}", place_text(o.center),
                     height_text(o.height), o.radius_m, o.clockwise ? "right" : "left", optional_text("turns", o.turns),
                     optional_text("duration_s", o.duration_s), optional_text("airspeed_mps", o.airspeed_mps));
}
std::string text(const SurveySetup& s) {
  return fmt::format(
      "survey: {{{}, height: {}, sensor: {}, forward_overlap: {}, side_overlap: {}{}, lead_in_m: {}, lead_out_m: "
      "{}{}{}}}",
      area_text(s.area), height_text(s.height), yaml_quoted(s.sensor), s.forward_overlap, s.side_overlap,
      optional_text("heading_deg", s.heading_deg), s.lead_in_m, s.lead_out_m,
      optional_text("airspeed_mps", s.airspeed_mps), optional_text("speed_mps", s.speed_mps));
}
std::string text(const RandomPathSetup& r) {
  return fmt::format(
      "random: {{{}, heights: [{}, {}], turn_radius_m: [{}, {}]{}, max_slope: {}, margin_m: {}{}}}", area_text(r.area),
      height_text(r.heights.first), height_text(r.heights.second), r.turn_radius_m.first, r.turn_radius_m.second,
      r.airspeed_mps ? fmt::format(", airspeed_mps: [{}, {}]", r.airspeed_mps->first, r.airspeed_mps->second) : "",
      r.max_slope, r.margin_m, optional_text("length_m", r.length_m));
}

}  // namespace

PlaceSetup read_place(const YamlMap& yaml) {
  PlaceSetup place;
  take(yaml.number("north_m"), place.north_m);
  take(yaml.number("east_m"), place.east_m);
  if (!yaml.has("lat_deg") && !yaml.has("lon_deg")) return place;
  for (const char* key : {"lat_deg", "lon_deg"}) yaml.require(key);
  for (const char* key : {"north_m", "east_m"})
    if (yaml.has(key)) yaml.fault(key, "expected none beside lat_deg and lon_deg: give the place one way");
  place.geodetic.emplace();
  take_within(yaml, "lat_deg", -90, 90, place.geodetic->lat_deg);
  take_within(yaml, "lon_deg", -360, 360, place.geodetic->lon_deg);
  return place;
}

std::vector<MissionItemSetup> read_mission(const YamlMap& vehicle, const TypedHeight& start, double turn_radius_m,
                                           std::span<const std::string_view> sensors) {
  std::vector<MissionItemSetup> items;
  TypedHeight height = start;
  for (const YamlMap& yaml : vehicle.maps("mission")) {
    MissionItemSetup item{{}, yaml.line(), yaml.name()};
    if (const auto orbit = yaml.map("orbit")) {
      item.what = read_orbit(*orbit, height);
    } else if (const auto survey = yaml.map("survey")) {
      SurveySetup read = read_survey(*survey, height, sensors);
      read_leads(*survey, read);
      read.airspeed_mps = positive(*survey, "airspeed_mps");
      item.what = read;
    } else if (const auto random = yaml.map("random")) {
      item.what = read_random(*random, height, turn_radius_m);
    } else if (!yaml.has("orbit") && !yaml.has("survey") && !yaml.has("random")) {
      item.what = read_waypoint(yaml, height);
    }
    height = height_after(item);
    items.push_back(std::move(item));
  }
  return items;
}

std::vector<MissionItemSetup> read_multirotor_mission(const YamlMap& vehicle, const TypedHeight& start,
                                                      double speed_mps, double acceleration_mps2,
                                                      std::span<const std::string_view> sensors) {
  std::vector<MissionItemSetup> items;
  TypedHeight height = start;
  for (const YamlMap& yaml : vehicle.maps("mission")) {
    MissionItemSetup item{{}, yaml.line(), yaml.name()};
    for (const char* key : {"orbit", "random"})
      if (yaml.map(key)) yaml.fault(key, "expected a waypoint or a survey: that is for fixed wings");
    if (const auto yaml_survey = yaml.map("survey")) {
      SurveySetup survey = read_survey(*yaml_survey, height, sensors);
      survey.speed_mps = positive(*yaml_survey, "speed_mps");
      // Up to speed at three quarters of v^2 / a, as trajectories change it; then a second to come to rest in attitude
      const double speed = survey.speed_mps.value_or(speed_mps);
      survey.lead_in_m = survey.lead_out_m = std::ceil(0.75 * speed * speed / acceleration_mps2 + speed);
      read_leads(*yaml_survey, survey);
      item.what = survey;
    } else if (!yaml.has("survey") && !yaml.has("orbit") && !yaml.has("random")) {
      WaypointSetup point = read_position(yaml, height);
      if (const auto hold = yaml.number("hold_s")) {
        point.hold_s = hold;
        if (!(*hold >= 0)) yaml.fault("hold_s", fmt::format("expected 0 or more, found {}", *hold));
      }
      point.yaw_deg = yaml.number("yaw_deg");
      point.speed_mps = positive(yaml, "speed_mps");
      item.what = point;
    }
    height = height_after(item);
    items.push_back(std::move(item));
  }
  return items;
}

std::string place_text(const PlaceSetup& place) {
  if (place.geodetic) return fmt::format("lat_deg: {}, lon_deg: {}", place.geodetic->lat_deg, place.geodetic->lon_deg);
  return fmt::format("north_m: {}, east_m: {}", place.north_m, place.east_m);
}

std::string height_text(const TypedHeight& height) {
  return fmt::format("{} {}", height.value_m, geodesy::to_string(height.datum));
}

std::string mission_item_text(const MissionItemSetup& item) {
  return fmt::format("{{{}}}", std::visit([](const auto& what) { return text(what); }, item.what));
}

}  // namespace nadir::sim

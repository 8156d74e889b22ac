#include "nadir/sim/run_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <regex>

#include "nadir/base/files.h"
#include "nadir/base/text.h"
#include "nadir/base/yaml.h"
#include "nadir/sim/vehicle_file.h"
#include "read_yaml.h"

namespace nadir::sim {
namespace {

using geodesy::HeightDatum, geodesy::TypedHeight;

void take_height(const YamlMap& map, std::string_view key, TypedHeight& out) {
  take(parsed<TypedHeight>(map, key, geodesy::parse_height), out);
}

/// Names become folders and file names.
void check_name(const YamlMap& parent, const std::string& name) {
  const bool plain =
      std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
  if (!plain) parent.fault(name, "expected a name of letters, digits, '_' and '-': it becomes a folder");
}

MapSetup read_map(const YamlMap& yaml) {
  MapSetup map;
  yaml.require("map");
  take(yaml.text("map"), map.map);
  map.role = parsed<tile::Role>(yaml, "role", tile::parse_role);
  take(yaml.texts("bands"), map.bands);
  map.radar_scale = parsed<tile::RadarScale>(yaml, "radar_scale", tile::parse_radar_scale);
  return map;
}

std::vector<std::pair<std::string, MapSetup>> read_maps(const YamlMap& yaml, std::string_view key) {
  std::vector<std::pair<std::string, MapSetup>> maps;
  if (const auto list = yaml.map(key))
    for (const auto& [name, entry] : list->entries()) {
      check_name(*list, name);
      maps.emplace_back(name, read_map(entry));
    }
  return maps;
}

SceneSetup read_scene(const YamlMap& yaml) {
  SceneSetup scene;
  if (const auto origin = yaml.map("origin")) {
    scene.origin.emplace();
    for (const char* key : {"lat_deg", "lon_deg"}) origin->require(key);
    take(origin->number("lat_deg"), scene.origin->lat_deg);
    take(origin->number("lon_deg"), scene.origin->lon_deg);
    take_height(*origin, "height", scene.origin->height);
    if (std::abs(scene.origin->lat_deg) > 90) origin->fault("lat_deg", "expected a latitude of at most 90 degrees");
    if (std::abs(scene.origin->lon_deg) > 360) origin->fault("lon_deg", "expected a longitude of at most 360 degrees");
  }
  take_height(yaml, "ground", scene.ground);
  if (scene.ground.datum == HeightDatum::Agl)
    yaml.fault("ground", "expected a height above the ellipsoid or msl: it is the ground");
  if (const auto name = yaml.text("surface")) {
    const auto shape = parse_surface_shape(*name);
    if (shape)
      scene.surface = *shape;
    else
      yaml.fault("surface", shape.error().message);
  }
  yaml.require("layers");
  scene.layers = read_maps(yaml, "layers");
  scene.onboard = read_maps(yaml, "onboard");
  return scene;
}

void read_mount(const YamlMap& yaml, SensorSetup& sensor) {
  static constexpr std::array<const char*, 3> position = {"x_m", "y_m", "z_m"},
                                              angles = {"yaw_deg", "pitch_deg", "roll_deg"};
  for (std::size_t i = 0; i < 3; ++i) {
    take(yaml.number(position[i]), sensor.mount_position_m[i]);
    take(yaml.number(angles[i]), sensor.mount_yaw_pitch_roll_deg[i]);
  }
}

void take_rate(const YamlMap& yaml, std::string_view key, Rate& rate, std::string& text) {
  if (const auto value = parsed<Rate>(yaml, key, Rate::parse_hz)) {
    rate = *value;
    text = *yaml.text(key);
  }
}

void read_sampling(const YamlMap& yaml, SensorSetup& sensor) {
  sensor.quality = parsed<render::Quality>(yaml, "quality", render::parse_quality);
  sensor.oversampling = yaml.number("oversampling");
  if (sensor.oversampling && !(*sensor.oversampling >= 0.5 && *sensor.oversampling <= 16))
    yaml.fault("oversampling", fmt::format("expected 0.5 to 16 samples across, found {}", *sensor.oversampling));
  sensor.time_budget_ms = positive(yaml, "time_budget_ms");
  sensor.fitted_to_ms = positive(yaml, "fitted_to_ms");
  take(yaml.flag("adaptive"), sensor.adaptive);
  if (sensor.adaptive && !yaml.has("time_budget_ms"))
    yaml.fault("adaptive", "expected time_budget_ms beside it: the time that frames may take");
  for (const char* key : {"quality", "oversampling", "fitted_to_ms"})
    if (yaml.has("time_budget_ms") && yaml.has(key))
      yaml.fault(key, "expected none beside time_budget_ms, which chooses the way of sampling: leave out one of them");
}

SensorSetup read_sensor(const YamlMap& yaml, const SceneSetup& scene) {
  SensorSetup sensor;
  for (const char* key : {"layer", "camera", "rate_hz"}) yaml.require(key);
  std::vector<std::string_view> layers;
  for (const auto& [name, map] : scene.layers) layers.push_back(name);
  if (const auto layer = yaml.text("layer")) {
    if (std::find(layers.begin(), layers.end(), *layer) == layers.end())
      yaml.fault("layer", fmt::format("no layer '{}' in the scene{}", *layer, suggestion(*layer, layers)));
    sensor.layer = *layer;
  }
  take(yaml.text("camera"), sensor.camera);
  sensor.rate_of_survey = yaml.text("rate_hz") == "survey";
  if (!sensor.rate_of_survey) take_rate(yaml, "rate_hz", sensor.rate, sensor.rate_text);
  if (const auto mount = yaml.map("mount")) read_mount(*mount, sensor);
  sensor.output = parsed<tile::SampleType>(yaml, "output", tile::parse_sample_type);
  if (const auto range = yaml.numbers("range")) {
    if (range->size() != 2 || !((*range)[0] < (*range)[1]))
      yaml.fault("range", "expected two rising numbers such as [0, 3000]");
    else
      sensor.range = {(*range)[0], (*range)[1]};
  }
  take(parsed<render::OffMap>(yaml, "off_map", render::parse_off_map), sensor.off_map);
  take(yaml.number("fill_value"), sensor.fill_value);
  take(yaml.flag("allow_coarse"), sensor.allow_coarse);
  take(yaml.number("exposure_s"), sensor.shutter.exposure_s);
  take(yaml.number("readout_s"), sensor.shutter.readout_s);
  if (const auto ok = render::check(sensor.shutter); !ok)
    yaml.fault(ok.error().message.starts_with("exposure") ? "exposure_s" : "readout_s", ok.error().message);
  read_sampling(yaml, sensor);
  return sensor;
}

void read_sensors(const YamlMap& yaml, const SceneSetup& scene, VehicleSetup& vehicle) {
  for (const auto& [name, entry] : yaml.entries()) {
    check_name(yaml, name);
    vehicle.sensors.emplace_back(name, read_sensor(entry, scene));
  }
}

/// A sensor that leaves its rate to a survey needs one.
void check_rates(const YamlMap& sensors, const VehicleSetup& vehicle) {
  for (const auto& [name, sensor] : vehicle.sensors) {
    const bool surveys = std::any_of(vehicle.mission.begin(), vehicle.mission.end(), [&name = name](const auto& item) {
      const auto* survey = std::get_if<SurveySetup>(&item.what);
      return survey && survey->sensor == name;
    });
    if (sensor.rate_of_survey && !surveys)
      sensors.fault(name, "leaves its rate_hz to a survey, and no survey of the mission names it: expected a rate");
  }
}

Scheme read_integration(const YamlMap& yaml) {
  Scheme scheme;
  yaml.require("method");
  take(parsed<Scheme::Method>(yaml, "method", parse_method), scheme.method);
  const char *const ours = is_fixed(scheme.method) ? "steps" : "tightness", *const others = is_fixed(scheme.method)
                                                                                                ? "tightness"
                                                                                                : "steps";
  if (yaml.has(others)) yaml.fault(others, fmt::format("{} has none: it has {}", name_of(scheme.method), ours));
  if (const auto steps = yaml.integer("steps")) {
    scheme.steps = static_cast<int>(std::clamp<std::int64_t>(*steps, 0, 10'001));
    if (*steps < 1 || *steps > 10'000) yaml.fault("steps", "expected 1 to 10000 steps a period of 10 ms");
  }
  if (const auto tightness = yaml.number("tightness")) {
    scheme.tightness = *tightness;
    if (!(*tightness >= 1e-6 && *tightness <= 1)) yaml.fault("tightness", "expected 1e-6 to 1 of the tolerance");
  }
  return scheme;
}

/// A name, or parameters of the vehicle's own.
void read_model(const YamlMap& yaml, const std::filesystem::path& folder, VehicleSetup& vehicle) {
  if (yaml.is_map("model")) {
    vehicle.parameters = sim::read_vehicle(*yaml.map("model"), folder);
    return;
  }
  take(yaml.text("model"), vehicle.model);
  std::vector<std::string_view> models = vehicle_models();
  models.push_back("poses");
  if (std::find(models.begin(), models.end(), vehicle.model) != models.end()) return;
  yaml.fault("model", fmt::format("no model '{}'{}", vehicle.model, suggestion(vehicle.model, models)));
  // So that its other faults are found: of the kind that it most likely is
  const std::string meant = nearest_name(vehicle.model, vehicle_models());
  vehicle.model = meant.empty() ? VehicleSetup().model : meant;
}

VehicleSetup read_vehicle(const YamlMap& yaml, const SceneSetup& scene, const std::filesystem::path& folder) {
  VehicleSetup vehicle;
  read_model(yaml, folder, vehicle);
  const auto sensors = yaml.map("sensors");
  if (sensors) read_sensors(*sensors, scene, vehicle);
  if (vehicle.model == "poses") {
    yaml.require("poses");
    take(yaml.text("poses"), vehicle.poses);
  } else {
    const VehicleParameters parameters = vehicle.vehicle();
    const auto* multirotor = std::get_if<Multirotor>(&parameters);
    if (!multirotor) vehicle.airspeed_mps = std::get<FixedWing>(parameters).cruise_mps;
    yaml.require("start");
    if (const auto start = yaml.map("start")) {
      start->require("height");
      vehicle.start.place = read_place(*start);
      take_height(*start, "height", vehicle.start.height);
      take(start->number("yaw_deg"), vehicle.yaw_deg);
      if (!multirotor) take_positive(*start, "airspeed_mps", vehicle.airspeed_mps);
    }
    take(yaml.flag("repeat_mission"), vehicle.repeat_mission);
    vehicle.ground = read_ground(yaml);
    if (vehicle.ground.land && vehicle.repeat_mission)
      yaml.fault("land", "expected no repeat_mission beside it: a mission that repeats never lands");
    take_positive(yaml, "trajectory_tolerance_m", vehicle.trajectory_tolerance_m);
    if (!(vehicle.trajectory_tolerance_m >= 1e-6)) yaml.fault("trajectory_tolerance_m", "expected at least 1e-6");
    if (const auto integration = yaml.map("integration")) vehicle.integration = read_integration(*integration);
    std::vector<std::string_view> names;
    for (const auto& [name, sensor] : vehicle.sensors) names.push_back(name);
    if (multirotor) {
      vehicle.multirotor = read_multirotor(yaml, multirotor->battery);
      vehicle.mission = read_multirotor_mission(yaml, vehicle.start.height, vehicle.multirotor->speed_mps,
                                                vehicle.multirotor->acceleration_mps2, names);
    } else {
      take_positive(yaml, "turn_radius_m", vehicle.turn_radius_m);
      if (const auto autopilot = yaml.map("autopilot")) vehicle.autopilot = read_autopilot(*autopilot);
      vehicle.mission = read_mission(yaml, vehicle.start.height, vehicle.turn_radius_m, names);
    }
  }
  if (sensors) check_rates(*sensors, vehicle);
  return vehicle;
}

void read_record(const YamlMap& yaml, RunFile& run) {
  take(yaml.flag("frames"), run.record_frames);
  take(parsed<TelemetryFormat>(yaml, "telemetry", parse_telemetry_format), run.telemetry);
  take_rate(yaml, "telemetry_rate_hz", run.telemetry_rate, run.telemetry_rate_text);
  take(yaml.flag("report"), run.record_report);
  take(yaml.flag("truth_rows"), run.record_truth_rows);
  take(yaml.flag("truth_planes"), run.record_truth_planes);
}

void read_run(const YamlMap& yaml, RunFile& run) {
  for (const char* key : {"scene", "vehicles", "duration_s"}) yaml.require(key);
  if (const auto seed = yaml.integer("seed")) {
    if (*seed < 0) yaml.fault("seed", "expected a whole number from 0");
    run.seed = static_cast<std::uint64_t>(*seed);
  }
  take(yaml.text("epoch_utc"), run.epoch_utc);
  static const std::regex utc(
      R"(\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])T([01]\d|2[0-3]):[0-5]\d:([0-5]\d|60)(\.\d{1,9})?Z)");
  if (!std::regex_match(run.epoch_utc, utc))
    yaml.fault("epoch_utc", fmt::format("expected a time such as 2026-06-21T10:00:00Z, found '{}'", run.epoch_utc));
  if (const auto duration = parsed<std::int64_t>(yaml, "duration_s", parse_seconds_as_ns)) {
    if (*duration <= 0) yaml.fault("duration_s", "expected a positive time");
    run.duration_ns = *duration;
    run.duration_text = *yaml.text("duration_s");
  }
  if (const auto scene = yaml.map("scene")) run.scene = read_scene(*scene);
  if (const auto environment = yaml.map("environment")) {
    if (const auto earth = environment->text("earth")) {
      run.flat_earth = *earth == "flat";
      if (*earth != "flat" && *earth != "wgs84")
        environment->fault("earth", fmt::format("expected wgs84 or flat, found '{}'", *earth));
    }
  }
  if (const auto air = yaml.map("air")) {
    run.air = read_air(*air);
    const AtmosphereOffsets& day = run.air.atmosphere;
    if (run.flat_earth && (day.temperature_k != 0 || day.pressure_pa != 0))
      air->fault("atmosphere", "has no effect over a flat Earth, whose density is constant: leave one of them out");
  }
  if (const auto rendering = yaml.map("render")) {
    take(parsed<render::Quality>(*rendering, "quality", render::parse_quality), run.quality);
    take_positive(*rendering, "geometry_tolerance_px", run.geometry_tolerance_px);
    if (run.geometry_tolerance_px > 1) rendering->fault("geometry_tolerance_px", "expected at most 1");
  }
  if (const auto vehicles = yaml.map("vehicles"))
    for (const auto& [name, entry] : vehicles->entries()) {
      check_name(*vehicles, name);
      run.vehicles.emplace_back(name, read_vehicle(entry, run.scene, run.folder));
    }
  if (yaml.has("vehicles") && run.vehicles.empty()) yaml.fault("vehicles", "expected at least one vehicle");
  if (const auto record = yaml.map("record")) read_record(*record, run);
}

}  // namespace

render::Mount SensorSetup::mount() const {
  const auto &p = mount_position_m, &a = mount_yaw_pitch_roll_deg;
  return {{p[0], p[1], p[2]}, geodesy::YawPitchRoll::degrees(a[0], a[1], a[2])};
}

VehicleParameters VehicleSetup::vehicle() const { return parameters ? *parameters : vehicle_model(model).value(); }

FixedWing VehicleSetup::fixed_wing() const { return std::get<FixedWing>(vehicle()); }

Multirotor VehicleSetup::multirotor_vehicle() const {
  Multirotor copter = std::get<Multirotor>(vehicle());
  if (multirotor->battery) copter.battery = multirotor->battery;
  return copter;
}

Result<RunFile> read_run_file(const std::filesystem::path& path) {
  const auto text = read_text_file(path);
  if (!text) return fail(text);
  const auto yaml = YamlMap::parse(path.string(), *text);
  if (!yaml) return fail(yaml);
  RunFile run;
  run.file = path;
  run.folder = std::filesystem::absolute(path).parent_path();
  read_run(*yaml, run);
  if (auto ok = yaml->finish(); !ok) return fail(ok);
  return run;
}

namespace {
constexpr std::array<std::string_view, 2> surface_names = {"plane", "ellipsoid"};
constexpr std::array<std::string_view, 3> telemetry_names = {"none", "csv", "npy"};
}  // namespace

std::string_view to_string(SurfaceShape shape) { return surface_names[static_cast<std::size_t>(shape)]; }
Result<SurfaceShape> parse_surface_shape(std::string_view text) {
  return parse_name<SurfaceShape>("surface", text, surface_names);
}

std::string_view to_string(TelemetryFormat format) { return telemetry_names[static_cast<std::size_t>(format)]; }
Result<TelemetryFormat> parse_telemetry_format(std::string_view text) {
  return parse_name<TelemetryFormat>("telemetry format", text, telemetry_names);
}

}  // namespace nadir::sim

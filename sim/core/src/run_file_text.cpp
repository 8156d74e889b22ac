#include <fmt/format.h>

#include "nadir/base/yaml.h"
#include "nadir/sim/run_file.h"
#include "nadir/sim/vehicle_file.h"

namespace nadir::sim {
namespace {

std::string map_text(const RunFile& run, const MapSetup& map) {
  std::string text = "{map: " + yaml_quoted(run.resolve(map.map).string());
  if (map.role) text += fmt::format(", role: {}", tile::to_string(*map.role));
  if (!map.bands.empty()) {
    std::vector<std::string> bands;
    for (const std::string& band : map.bands) bands.push_back(yaml_quoted(band));
    text += fmt::format(", bands: [{}]", fmt::join(bands, ", "));
  }
  if (map.radar_scale) text += fmt::format(", radar_scale: {}", tile::to_string(*map.radar_scale));
  return text + "}";
}

std::string sensor_text(const RunFile& run, const SensorSetup& sensor) {
  const auto &p = sensor.mount_position_m, &a = sensor.mount_yaw_pitch_roll_deg;
  std::string text = fmt::format(
      "{{layer: {}, camera: {}, rate_hz: {},\n        mount: {{x_m: {}, y_m: {}, z_m: {}, yaw_deg: {}, pitch_deg: {}, "
      "roll_deg: {}}},\n        off_map: {}",
      yaml_quoted(sensor.layer), yaml_quoted(run.resolve(sensor.camera).string()),
      sensor.rate_of_survey ? "survey" : sensor.rate_text, p[0], p[1], p[2], a[0], a[1], a[2],
      render::to_string(sensor.off_map));
  if (sensor.off_map == render::OffMap::Fill) text += fmt::format(", fill_value: {}", sensor.fill_value);
  if (sensor.shutter.exposure_s > 0) text += fmt::format(", exposure_s: {}", sensor.shutter.exposure_s);
  if (sensor.shutter.readout_s > 0) text += fmt::format(", readout_s: {}", sensor.shutter.readout_s);
  if (sensor.quality) text += fmt::format(", quality: {}", render::to_string(*sensor.quality));
  if (sensor.oversampling) text += fmt::format(", oversampling: {}", *sensor.oversampling);
  if (sensor.time_budget_ms) text += fmt::format(", time_budget_ms: {}", *sensor.time_budget_ms);
  if (sensor.adaptive) text += ", adaptive: true";
  if (sensor.fitted_to_ms) text += fmt::format(", fitted_to_ms: {}", *sensor.fitted_to_ms);
  if (sensor.allow_coarse) text += ", allow_coarse: true";
  if (sensor.output) text += fmt::format(", output: {}", tile::to_string(*sensor.output));
  if (sensor.range) text += fmt::format(", range: [{}, {}]", sensor.range->first, sensor.range->second);
  return text + "}";
}

std::string integration_text(const Scheme& scheme) {
  return fmt::format("    integration: {{method: {}, {}}}\n", name_of(scheme.method),
                     is_fixed(scheme.method) ? fmt::format("steps: {}", scheme.steps)
                                             : fmt::format("tightness: {}", scheme.tightness));
}

std::string vehicle_text(const RunFile& run, const VehicleSetup& vehicle) {
  std::string text = vehicle.parameters ? "    model:\n" + to_yaml(*vehicle.parameters, "      ")
                                        : fmt::format("    model: {}\n", vehicle.model);
  if (vehicle.model == "poses") {
    text += fmt::format("    poses: {}\n", yaml_quoted(run.resolve(vehicle.poses).string()));
  } else {
    text += fmt::format("    start: {{{}, height: {}, yaw_deg: {}", place_text(vehicle.start.place),
                        height_text(vehicle.start.height), vehicle.yaw_deg);
    text += vehicle.multirotor ? std::string("}\n") : fmt::format(", airspeed_mps: {}}}\n", vehicle.airspeed_mps);
    if (!vehicle.multirotor)
      text += fmt::format("    turn_radius_m: {}\n    autopilot: {}\n", vehicle.turn_radius_m,
                          autopilot_text(vehicle.autopilot));
    text += fmt::format("    repeat_mission: {}\n", vehicle.repeat_mission);
    if (!vehicle.multirotor) text += ground_text(vehicle.ground);
    text += fmt::format("    trajectory_tolerance_m: {}\n", vehicle.trajectory_tolerance_m);
    if (vehicle.integration) text += integration_text(*vehicle.integration);
    if (vehicle.multirotor) text += multirotor_text(*vehicle.multirotor);
    if (!vehicle.mission.empty()) text += "    mission:\n";
    for (const MissionItemSetup& item : vehicle.mission) text += fmt::format("      - {}\n", mission_item_text(item));
  }
  if (!vehicle.sensors.empty()) text += "    sensors:\n";
  for (const auto& [name, sensor] : vehicle.sensors)
    text += fmt::format("      {}: {}\n", yaml_quoted(name), sensor_text(run, sensor));
  return text;
}

}  // namespace

std::string to_yaml(const RunFile& run) {
  std::string text =
      fmt::format("seed: {}\nepoch_utc: {}\nduration_s: {}\n", run.seed, yaml_quoted(run.epoch_utc), run.duration_text);
  text += "scene:\n";
  if (run.scene.origin)
    text += fmt::format("  origin: {{lat_deg: {}, lon_deg: {}, height: {}}}\n", run.scene.origin->lat_deg,
                        run.scene.origin->lon_deg, height_text(run.scene.origin->height));
  text += fmt::format("  surface: {}\n  ground: {}\n  layers:\n", to_string(run.scene.surface),
                      height_text(run.scene.ground));
  for (const auto& [name, map] : run.scene.layers)
    text += fmt::format("    {}: {}\n", yaml_quoted(name), map_text(run, map));
  if (!run.scene.onboard.empty()) text += "  onboard:\n";
  for (const auto& [name, map] : run.scene.onboard)
    text += fmt::format("    {}: {}\n", yaml_quoted(name), map_text(run, map));
  text += fmt::format("environment: {{earth: {}}}\n", run.flat_earth ? "flat" : "wgs84");
  text += air_text(run.air, run.air.field ? run.resolve(run.air.field->map).string() : "");
  text += fmt::format("render: {{quality: {}, geometry_tolerance_px: {}}}\nvehicles:\n", render::to_string(run.quality),
                      run.geometry_tolerance_px);
  for (const auto& [name, vehicle] : run.vehicles)
    text += fmt::format("  {}:\n{}", yaml_quoted(name), vehicle_text(run, vehicle));
  text += fmt::format(
      "record: {{frames: {}, telemetry: {}, telemetry_rate_hz: {}, report: {}, truth_rows: {}, truth_planes: {}}}\n",
      run.record_frames, to_string(run.telemetry), run.telemetry_rate_text, run.record_report, run.record_truth_rows,
      run.record_truth_planes);
  return text;
}

}  // namespace nadir::sim

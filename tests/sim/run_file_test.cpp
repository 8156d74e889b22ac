#include "nadir/sim/run_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "nadir/sim/vehicle_file.h"
#include "support/temporary_folder.h"

namespace nadir::sim {
namespace {

using geodesy::HeightDatum;

constexpr const char* full_run = R"(seed: 7
epoch_utc: 2026-06-21T10:00:00Z
scene:
  origin: {lat_deg: 38.10, lon_deg: -0.76, height: 0.1 ellipsoid}
  surface: plane
  ground: 15 msl
  layers:
    eo:  {map: spain_s2.tif, role: optical, bands: [4, 3, B2]}
    sar: {map: /maps/spain_s1.tif, role: radar, bands: [VV], radar_scale: decibel}
  onboard: {eo_ref: {map: "spain 2018.tif", role: optical}}
environment: {earth: flat}
render: {quality: best, geometry_tolerance_px: 0.2}
vehicles:
  plane1:
    model: aerosonde
    start: {north_m: 0, east_m: -5.5, height: 3000 agl, yaw_deg: 90, airspeed_mps: 27.5}
    mission: [{north_m: 1500, east_m: 0, height: 2900 msl}, {north_m: 1500, east_m: 1500}]
    turn_radius_m: 300
    repeat_mission: true
    trajectory_tolerance_m: 1e-4
    integration: {method: dormand-prince, tightness: 0.1}
    sensors:
      rgb: {layer: eo, camera: rgb.yaml, rate_hz: 29.97, mount: {pitch_deg: 0.1, x_m: 0.3}, output: uint8, range: [0, 2500], off_map: fill, fill_value: 0.7, quality: draft, oversampling: 2.5, fitted_to_ms: 12.5}
      sar: {layer: sar, camera: ../sar.yaml, rate_hz: 2, output: float32, off_map: reject, allow_coarse: true, time_budget_ms: 0.1, adaptive: true}
  copter:
    model: poses
    poses: flown.csv
record: {frames: false, telemetry: none, telemetry_rate_hz: 0.5, report: false, truth_rows: true, truth_planes: true}
duration_s: 60.000000001
air: {wind: {from_deg: 187.1, speed_mps: 8.3, up_mps: 1e-3}, shear: {law: power, exponent: 0.2}, turbulence: {intensity: severe}}
)";

constexpr const char* small_run = R"(duration_s: 1
scene:
  layers:
    eo: {map: m.tif}
vehicles:
  p:
    start: {height: 100 agl}
    sensors:
      cam: {layer: eo, camera: c.yaml, rate_hz: 1}
)";

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

class RunFileText : public testing::Test {
 protected:
  Result<RunFile> read(const std::string& text) { return read_run_file(folder.write("run.yaml", text)); }
  /// What is said of a file, with its folder left out.
  std::string message(const std::string& text) {
    const auto run = read(text);
    if (run) return "accepted";
    std::string said = run.error().message;
    const std::string path = folder.path().string() + "/";
    for (auto at = said.find(path); at != std::string::npos; at = said.find(path)) said.erase(at, path.size());
    return said;
  }
  test::TemporaryFolder folder;
};

TEST_F(RunFileText, EveryKeyArrivesWhereItBelongs) {
  const RunFile run = read(full_run).value();
  EXPECT_EQ(run.seed, 7u);
  EXPECT_EQ(run.epoch_utc, "2026-06-21T10:00:00Z");
  EXPECT_EQ(run.duration_ns, 60'000'000'001) << "a time is never a double";
  EXPECT_EQ(run.scene.origin->lat_deg, 38.10);
  EXPECT_EQ(run.scene.origin->height.value_m, 0.1);
  EXPECT_EQ(run.scene.ground.datum, HeightDatum::Msl);
  ASSERT_EQ(run.scene.layers.size(), 2u);
  const auto& [eo_name, eo] = run.scene.layers[0];
  EXPECT_EQ(eo_name, "eo");
  EXPECT_EQ(eo.bands, (std::vector<std::string>{"4", "3", "B2"}));
  EXPECT_EQ(run.resolve(eo.map), folder.path() / "spain_s2.tif") << "paths count from the run file's folder";
  EXPECT_EQ(run.resolve(run.scene.layers[1].second.map), "/maps/spain_s1.tif");
  EXPECT_EQ(run.scene.layers[1].second.role, tile::Role::Radar);
  EXPECT_FALSE(run.vehicles[0].second.sensors[0].second.allow_coarse);
  EXPECT_TRUE(run.vehicles[0].second.sensors[1].second.allow_coarse);
  EXPECT_EQ(run.scene.layers[1].second.radar_scale, tile::RadarScale::Decibel);
  ASSERT_EQ(run.scene.onboard.size(), 1u) << "the onboard reference is no sensor source";
  EXPECT_EQ(run.scene.onboard[0].second.map, "spain 2018.tif");
  EXPECT_TRUE(run.flat_earth);
  EXPECT_EQ(run.air.wind_up_mps, 1e-3);
  EXPECT_EQ(run.quality, render::Quality::best);
  EXPECT_EQ(run.geometry_tolerance_px, 0.2);

  ASSERT_EQ(run.vehicles.size(), 2u);
  const VehicleSetup& plane = run.vehicles[0].second;
  EXPECT_EQ(plane.start.place.east_m, -5.5);
  EXPECT_EQ(plane.airspeed_mps, 27.5);
  ASSERT_EQ(plane.mission.size(), 2u);
  const auto& second = std::get<WaypointSetup>(plane.mission[1].what);
  EXPECT_EQ(second.height.value_m, 2900) << "a waypoint without height keeps the last one's";
  EXPECT_EQ(second.height.datum, HeightDatum::Msl);
  EXPECT_EQ(plane.mission[1].line, 17);
  EXPECT_TRUE(plane.repeat_mission);
  EXPECT_EQ(plane.trajectory_tolerance_m, 1e-4);
  EXPECT_EQ(plane.integration, (Scheme{.method = Scheme::Method::DormandPrince, .tightness = 0.1}));
  ASSERT_EQ(plane.sensors.size(), 2u);
  const SensorSetup& rgb = plane.sensors[0].second;
  EXPECT_EQ(rgb.rate.time_ns(2997), 100'000'000'000);
  EXPECT_EQ(rgb.mount_yaw_pitch_roll_deg, (std::array<double, 3>{0, 0.1, 0}));
  EXPECT_EQ(rgb.mount_position_m, (std::array<double, 3>{0.3, 0, 0}));
  EXPECT_EQ(rgb.output, tile::SampleType::UInt8);
  EXPECT_EQ(rgb.range, std::pair(0.0, 2500.0));
  EXPECT_EQ(rgb.off_map, render::OffMap::Fill);
  EXPECT_EQ(rgb.fill_value, 0.7);
  EXPECT_EQ(rgb.quality, render::Quality::draft);
  EXPECT_EQ(rgb.oversampling, 2.5);
  EXPECT_EQ(rgb.fitted_to_ms, 12.5);
  EXPECT_FALSE(rgb.time_budget_ms || rgb.adaptive);
  EXPECT_EQ(plane.sensors[1].second.off_map, render::OffMap::Reject);
  EXPECT_EQ(plane.sensors[1].second.time_budget_ms, 0.1);
  EXPECT_TRUE(plane.sensors[1].second.adaptive);
  EXPECT_EQ(run.vehicles[1].second.poses, "flown.csv");
  EXPECT_FALSE(run.record_frames || run.record_report);
  EXPECT_EQ(run.telemetry, TelemetryFormat::None);
  EXPECT_TRUE(run.record_truth_rows && run.record_truth_planes);
  EXPECT_EQ(run.telemetry_rate.time_ns(1), 2'000'000'000);
}

TEST_F(RunFileText, HowMotionIsSteppedIsOfItsMethod) {
  const auto with = [&](const std::string& lines) {
    return message(replaced(small_run, "    sensors:", "    " + lines + "\n    sensors:"));
  };
  EXPECT_EQ(with("integration: {method: rk4, steps: 3}"), "accepted");
  EXPECT_NE(with("integration: {method: rk4, tightness: 0.5}").find("run.yaml:8"), std::string::npos);
  EXPECT_NE(with("integration: {method: rosenbrock, steps: 3}").find("it has tightness"), std::string::npos);
  EXPECT_NE(with("integration: {method: rk5}").find("rk4"), std::string::npos);
  EXPECT_NE(with("integration: {steps: 3}").find("method"), std::string::npos);
  EXPECT_NE(with("integration: {method: euler, steps: 0}").find("expected 1 to 10000"), std::string::npos);
  EXPECT_NE(with("integration: {method: euler, steps: 99999999999}").find("expected 1 to 10000"), std::string::npos);
  EXPECT_NE(with("integration: {method: rosenbrock, tightness: 0}").find("1e-6 to 1"), std::string::npos);
  EXPECT_NE(with("trajectory_tolerance_m: 0").find("trajectory_tolerance_m"), std::string::npos);
}

TEST_F(RunFileText, AModelIsANameOrParameters) {
  const auto with = [](const std::string& lines) {
    return replaced(small_run, "    start:", "    " + lines + "\n    start:");
  };
  const auto vehicle = [&](const std::string& lines) { return read(with(lines)).value().vehicles[0].second; };
  EXPECT_EQ(vehicle("model: anaconda").airspeed_mps, 15) << "the model's own";
  EXPECT_NE(message(with("model: anacondo")).find("did you mean 'anaconda'?"), std::string::npos);

  const VehicleSetup changed = vehicle("model: {base: anaconda, mass_kg: 5, cruise_mps: 17}");
  EXPECT_EQ(changed.fixed_wing().mass.mass_kg(), 5);
  EXPECT_EQ(changed.airspeed_mps, 17);
  const std::string wrong = message(with("model: {base: anaconda, mass_kg: -5, wing: {span: 2}}"));
  EXPECT_NE(wrong.find("run.yaml:7: 'vehicles.p.model.mass_kg': expected a number above 0"), std::string::npos)
      << wrong;
  EXPECT_NE(wrong.find("unknown key 'vehicles.p.model.wing.span'"), std::string::npos) << wrong;

  const auto written = folder.write("plane.yaml", to_yaml(*changed.parameters));
  EXPECT_EQ(to_yaml(*vehicle("model: {file: plane.yaml}").parameters), to_yaml(*changed.parameters));
  folder.write("plane.yaml", "base: anaconda\nmass_kg: -1\nspan: 3\n");
  const std::string fault = message(with("model: {file: plane.yaml}"));
  EXPECT_NE(fault.find("plane.yaml:2: 'mass_kg'"), std::string::npos) << fault;
  EXPECT_NE(fault.find("plane.yaml:3: unknown key 'span'"), std::string::npos) << fault;
}

TEST_F(RunFileText, AnAutopilotsGainsAreChangedByTheirNames) {
  const auto with = [](const std::string& lines) {
    return replaced(small_run, "    sensors:", "    " + lines + "\n    sensors:");
  };
  const AutopilotSetup autopilot =
      read(with("autopilot: {control: total_energy, gains: {roll_kp: 1.5, circle: 4}, fly_unstable: true}"))
          .value()
          .vehicles[0]
          .second.autopilot;
  FlightGains gains;
  gains.autopilot.pitch_kp = 3;
  autopilot.apply(gains);
  EXPECT_EQ(gains.autopilot.control, Control::TotalEnergy);
  EXPECT_EQ(gains.autopilot.roll_kp, 1.5);
  EXPECT_EQ(gains.autopilot.pitch_kp, 3) << "not named, not changed";
  EXPECT_EQ(gains.path.circle, 4);
  EXPECT_TRUE(autopilot.fly_unstable);
  EXPECT_NE(message(with("autopilot: {control: total_enery}")).find("total_energy"), std::string::npos);
  EXPECT_NE(message(with("autopilot: {gains: {rol_kp: 1}}")).find("did you mean 'roll_kp'?"), std::string::npos);
  EXPECT_NE(message(with("autopilot: {gains: {max_roll_rad: 45}}")).find("expected at most 1.4"), std::string::npos);
}

TEST_F(RunFileText, WhatIsNotSaidHasTheDocumentedDefault) {
  const RunFile run = read(small_run).value();
  EXPECT_EQ(run.seed, 0u);
  EXPECT_FALSE(run.scene.origin);
  EXPECT_EQ(run.scene.ground.value_m, 0);
  EXPECT_EQ(run.scene.ground.datum, HeightDatum::Ellipsoid);
  EXPECT_FALSE(run.flat_earth);
  EXPECT_EQ(run.quality, render::Quality::balanced);
  EXPECT_TRUE(run.record_frames && run.record_report);
  EXPECT_EQ(run.telemetry, TelemetryFormat::Csv);
  EXPECT_FALSE(run.record_truth_rows || run.record_truth_planes);
  EXPECT_EQ(run.telemetry_rate.time_ns(50), 1'000'000'000);
  const VehicleSetup& vehicle = run.vehicles[0].second;
  EXPECT_EQ(vehicle.model, "aerosonde");
  EXPECT_EQ(vehicle.airspeed_mps, 25);
  EXPECT_TRUE(vehicle.mission.empty());
  const SensorSetup& sensor = vehicle.sensors[0].second;
  EXPECT_EQ(sensor.off_map, render::OffMap::Mask);
  EXPECT_FALSE(sensor.output || sensor.range);
  EXPECT_FALSE(sensor.quality || sensor.oversampling || sensor.time_budget_ms || sensor.adaptive);
}

TEST_F(RunFileText, WrittenBackAndReadAgainNothingChanges) {
  const std::string awkward = replaced(replaced(small_run, "m.tif", "'a \"b\": {c}, #d é\\.tif'"), "height: 100 agl",
                                       "height: 1234567.0000001 msl, yaw_deg: -1e-17, north_m: 1e21");
  const std::string own = replaced(small_run, "    start:",
                                   "    model: {base: junker, mass_kg: 1.7, wing: {oswald: 0.87}}\n"
                                   "    autopilot: {gains: {roll_kp: 0.1, line_per_m: 1e-3}}\n    start:");
  for (const std::string& text : {std::string(full_run), std::string(small_run), awkward, own}) {
    const RunFile first = read(text).value();
    const std::string written = to_yaml(first);
    const test::TemporaryFolder elsewhere;  // from anywhere
    const auto second = read_run_file(elsewhere.write("replay.yaml", written));
    ASSERT_TRUE(second) << second.error().message << "\n" << written;
    EXPECT_EQ(to_yaml(*second), written);
    EXPECT_EQ(second->duration_ns, first.duration_ns);
    EXPECT_EQ(second->seed, first.seed);
    EXPECT_EQ(second->resolve(second->scene.layers[0].second.map), first.resolve(first.scene.layers[0].second.map));
    ASSERT_EQ(second->vehicles.size(), first.vehicles.size());
    for (std::size_t i = 0; i < first.vehicles.size(); ++i) {
      const VehicleSetup &a = first.vehicles[i].second, &b = second->vehicles[i].second;
      EXPECT_EQ(b.start.height.value_m, a.start.height.value_m) << "to the last digit";
      EXPECT_EQ(b.start.place.north_m, a.start.place.north_m);
      EXPECT_EQ(b.yaw_deg, a.yaw_deg);
      EXPECT_EQ(b.mission.size(), a.mission.size());
      ASSERT_EQ(b.sensors.size(), a.sensors.size());
      for (std::size_t s = 0; s < a.sensors.size(); ++s) {
        EXPECT_EQ(b.sensors[s].second.mount_yaw_pitch_roll_deg, a.sensors[s].second.mount_yaw_pitch_roll_deg);
        EXPECT_EQ(b.sensors[s].second.rate.time_ns(1'000'000), a.sensors[s].second.rate.time_ns(1'000'000));
        EXPECT_EQ(b.sensors[s].second.range, a.sensors[s].second.range);
        EXPECT_EQ(b.sensors[s].second.fill_value, a.sensors[s].second.fill_value);
        EXPECT_EQ(b.sensors[s].second.quality, a.sensors[s].second.quality);
        EXPECT_EQ(b.sensors[s].second.oversampling, a.sensors[s].second.oversampling);
        EXPECT_EQ(b.sensors[s].second.time_budget_ms, a.sensors[s].second.time_budget_ms);
        EXPECT_EQ(b.sensors[s].second.adaptive, a.sensors[s].second.adaptive);
        EXPECT_EQ(b.sensors[s].second.fitted_to_ms, a.sensors[s].second.fitted_to_ms);
      }
    }
    EXPECT_EQ(second->air.wind_from_deg, first.air.wind_from_deg);
  }
}

TEST_F(RunFileText, AnUnknownKeyIsToldWithItsLineAndTheNearestOne) {
  const auto said = [&](const std::string& what, const std::string& with) {
    return message(replaced(full_run, what, with));
  };
  EXPECT_EQ(said("seed:", "sede:"), "run.yaml:1: unknown key 'sede'; did you mean 'seed'?");
  EXPECT_EQ(said("ground:", "gruond:"), "run.yaml:6: unknown key 'scene.gruond'; did you mean 'ground'?");
  EXPECT_EQ(said("role: radar", "rol: radar"), "run.yaml:9: unknown key 'scene.layers.sar.rol'; did you mean 'role'?");
  EXPECT_EQ(said("pitch_deg: 0.1", "pitch: 0.1"),
            "run.yaml:23: unknown key 'vehicles.plane1.sensors.rgb.mount.pitch'; known are x_m, yaw_deg, y_m, "
            "pitch_deg, z_m, roll_deg");
  EXPECT_EQ(said("{north_m: 1500, east_m: 1500}", "{north_m: 1500, east_m: 1500, heihgt: 3}"),
            "run.yaml:17: unknown key 'vehicles.plane1.mission[1].heihgt'; did you mean 'height'?");
  EXPECT_EQ(said("truth_rows:", "truth_row:"),
            "run.yaml:28: unknown key 'record.truth_row'; did you mean 'truth_rows'?");
}

TEST_F(RunFileText, AllFaultsAreInOneMessage) {
  std::string text = full_run;
  for (const auto& [what, with] : {std::pair("seed: 7", "seed: -7"),
                                   {"lat_deg: 38.10", "lat_deg: 95"},
                                   {"role: radar", "role: rader"},
                                   {"quality: best", "quality: bset"},
                                   {"model: aerosonde", "model: aerosond"},
                                   {"layer: eo,", "layer: e0,"},
                                   {"range: [0, 2500]", "range: [2500, 0]"},
                                   {"duration_s: 60.000000001", "duration_s: 0"}})
    text = replaced(text, what, with);
  const std::string said = message(text);
  std::size_t at = 0;
  for (const char* part :
       {"run.yaml:1: 'seed': expected a whole number from 0", "run.yaml:4: 'scene.origin.lat_deg': expected a latitude",
        "run.yaml:9: 'scene.layers.sar.role':", "run.yaml:12: 'render.quality':",
        "run.yaml:15: 'vehicles.plane1.model': no model 'aerosond'; did you mean 'aerosonde'?",
        "run.yaml:23: 'vehicles.plane1.sensors.rgb.layer': no layer 'e0' in the scene; did you mean 'eo'?",
        "run.yaml:23: 'vehicles.plane1.sensors.rgb.range': expected two rising numbers",
        "run.yaml:29: 'duration_s': expected a positive time"}) {
    const std::size_t found = said.find(part);
    EXPECT_NE(found, std::string::npos) << part << "\nin\n" << said;
    EXPECT_GE(found, at) << part << " comes too early";
    at = found;
  }
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 7) << "one line each:\n" << said;
}

TEST_F(RunFileText, NamesThatWouldLeaveTheDatasetFolderAreRefused) {
  for (const char* bad : {"../x", "a/b", "..", ".", "a b", "é"})
    for (const auto& [key, indent, place] : {std::tuple("  p:", "  ", "vehicles"),
                                             {"cam:", "", "vehicles.p.sensors"},
                                             {"    eo:", "    ", "scene.layers"}}) {
      const std::string said = message(replaced(small_run, key, fmt::format("{}'{}':", indent, bad)));
      EXPECT_NE(said.find(fmt::format("'{}.{}': expected a name of letters, digits", place, bad)), std::string::npos)
          << said;
    }
  EXPECT_EQ(message(replaced(small_run, "cam:", "cam-2_B:")), "accepted");
}

TEST_F(RunFileText, WhatAVehicleOrASensorNeedsIsAskedFor) {
  EXPECT_EQ(message("seed: 1\n"),
            "run.yaml:1: expected the key 'scene'\nrun.yaml:1: expected the key 'vehicles'\nrun.yaml:1: expected the "
            "key 'duration_s'");
  EXPECT_NE(message(replaced(small_run, "{layer: eo, camera: c.yaml, rate_hz: 1}", "{}"))
                .find("expected the key 'vehicles.p.sensors.cam.layer'"),
            std::string::npos);
  EXPECT_NE(message(replaced(small_run, "start: {height: 100 agl}", "model: poses"))
                .find("expected the key 'vehicles.p.poses'"),
            std::string::npos);
  EXPECT_NE(message(replaced(small_run, "start: {height: 100 agl}", "start: {yaw_deg: 1}"))
                .find("expected the key 'vehicles.p.start.height'"),
            std::string::npos);
  EXPECT_NE(
      message(replaced(small_run, "{map: m.tif}", "{role: radar}")).find("expected the key 'scene.layers.eo.map'"),
      std::string::npos);
  EXPECT_NE(message(replaced(small_run, "layer: eo", "layer: ''")).find("sensors.cam.layer': no layer ''"),
            std::string::npos);
}

TEST_F(RunFileText, ValuesThatCannotBeAreRefused) {
  const auto said = [&](const std::string& what, const std::string& with) {
    return message(replaced(full_run, what, with));
  };
  EXPECT_NE(said("rate_hz: 29.97", "rate_hz: 0").find("'0': expected a rate"), std::string::npos);
  EXPECT_NE(said("airspeed_mps: 27.5", "airspeed_mps: -1").find("expected a positive number"), std::string::npos);
  EXPECT_NE(said("turn_radius_m: 300", "turn_radius_m: .nan").find("expected a number"), std::string::npos);
  EXPECT_NE(said("geometry_tolerance_px: 0.2", "geometry_tolerance_px: 2").find("expected at most 1"),
            std::string::npos);
  EXPECT_NE(said("ground: 15 msl", "ground: 15 agl").find("it is the ground"), std::string::npos);
  EXPECT_NE(said("surface: plane", "surface: terrain").find("no surface 'terrain'"), std::string::npos);
  EXPECT_NE(said("earth: flat", "earth: disc").find("expected wgs84 or flat, found 'disc'"), std::string::npos);
  EXPECT_NE(said("telemetry: none", "telemetry: bag").find("no telemetry format 'bag'"), std::string::npos);
  EXPECT_NE(said("oversampling: 2.5", "oversampling: 17").find("expected 0.5 to 16 samples across, found 17"),
            std::string::npos);
  for (const char* bad : {"0", "-3"})
    EXPECT_NE(said("time_budget_ms: 0.1", fmt::format("time_budget_ms: {}", bad)).find("expected a positive number"),
              std::string::npos);
  for (const char* bad : {".nan", ".inf", "soon", "[1]"})
    EXPECT_NE(said("time_budget_ms: 0.1", fmt::format("time_budget_ms: {}", bad)).find("time_budget_ms"),
              std::string::npos);
  EXPECT_NE(said("time_budget_ms: 0.1, ", "").find("sensors.sar.adaptive': expected time_budget_ms beside it"),
            std::string::npos);
  const std::string both = said("fitted_to_ms: 12.5", "time_budget_ms: 12.5");
  for (const char* key : {"quality", "oversampling"})
    EXPECT_NE(both.find(fmt::format("sensors.rgb.{}': expected none beside time_budget_ms", key)), std::string::npos)
        << both;
  EXPECT_NE(said("duration_s: 60.000000001", "duration_s: 1e2").find("'duration_s'"), std::string::npos);
}

constexpr const char* windy_run = R"(duration_s: 1
scene: {layers: {eo: {map: m.tif}}}
vehicles: {p: {start: {height: 100 agl}}}
air:
  wind: {from_deg: 270, speed_mps: 7.5, up_mps: -0.25}
  shear: {law: logarithmic, reference_m: 12, roughness_m: 0.05, top_m: 250}
  gusts:
    - {start_s: 3.5, speed_mps: 6, gradient_m: 30, towards: up}
    - {start_s: 9, speed_mps: 4, gradient_m: 12.5, towards: left, shape: step}
  turbulence: {wind_at_20ft_mps: 9.1}
  atmosphere: {temperature_offset_k: 15.5, pressure_offset_pa: -900}
  field: {map: wind.tif, bands: [U10, V10], outside: calm}
)";

TEST_F(RunFileText, AirArrivesWhereItBelongsAndComesBackWhenWritten) {
  const RunFile run = read(windy_run).value();
  const test::TemporaryFolder elsewhere;
  const RunFile replay = read_run_file(elsewhere.write("replay.yaml", to_yaml(run))).value();
  EXPECT_EQ(to_yaml(replay), to_yaml(run));
  EXPECT_EQ(replay.resolve(replay.air.field->map), run.resolve(run.air.field->map));
  for (const AirSetup& air : {run.air, replay.air}) {
    EXPECT_EQ(air.wind_from_deg, 270);
    EXPECT_EQ(air.wind_speed_mps, 7.5);
    EXPECT_EQ(air.wind_up_mps, -0.25);
    EXPECT_EQ(air.shear.law, Shear::Law::Logarithmic);
    EXPECT_EQ(air.shear.reference_m, 12);
    EXPECT_EQ(air.shear.roughness_m, 0.05);
    EXPECT_EQ(air.shear.top_m, 250);
    ASSERT_EQ(air.gusts.size(), 2u);
    EXPECT_EQ(air.gusts[0].start_s, 3.5);
    EXPECT_EQ(air.gusts[0].shape, Gust::Shape::Pulse);
    EXPECT_EQ(air.gusts[0].towards, Gust::Towards::Up);
    EXPECT_EQ(air.gusts[1].gradient_m, 12.5);
    EXPECT_EQ(air.gusts[1].shape, Gust::Shape::Step);
    EXPECT_EQ(air.gusts[1].towards, Gust::Towards::Left);
    EXPECT_EQ(air.turbulence->wind_at_20ft_mps(), 9.1);
    EXPECT_EQ(air.atmosphere.temperature_k, 15.5);
    EXPECT_EQ(air.atmosphere.pressure_pa, -900);
    EXPECT_EQ(air.field->bands, (std::vector<std::string>{"U10", "V10"}));
    EXPECT_EQ(air.field->outside, MapWind::Outside::Calm);
  }
  const RunFile still = read(small_run).value();
  EXPECT_EQ(still.air.wind_speed_mps, 0);
  EXPECT_EQ(still.air.shear.law, Shear::Law::None);
  EXPECT_TRUE(still.air.gusts.empty());
  EXPECT_FALSE(still.air.turbulence || still.air.field);
}

TEST_F(RunFileText, EveryFaultOfTheAirIsToldWithItsLine) {
  std::string text = windy_run;
  for (const auto& [what, with] : {std::pair("speed_mps: 7.5", "speed_mps: 750"),
                                   {"law: logarithmic", "law: logaritmic"},
                                   {"top_m: 250", "top_m: 2"},
                                   {"gradient_m: 30", "gradient_m: 0"},
                                   {"towards: left", "towards: north"},
                                   {"{wind_at_20ft_mps: 9.1}", "{wind_at_20ft_mps: -9.1, intensity: rough}"},
                                   {"temperature_offset_k: 15.5", "temperature_offset_k: 288"},
                                   {"bands: [U10, V10]", "bands: [U10]"},
                                   {"outside: calm", "outsid: calm"}})
    text = replaced(text, what, with);
  const std::string said = message(text);
  for (const char* part :
       {"run.yaml:5: 'air.wind.speed_mps': expected a number from 0 to 200, found 750",
        "run.yaml:6: 'air.shear.law': no law of shear 'logaritmic'; did you mean 'logarithmic'?",
        "run.yaml:6: 'air.shear.top_m': expected at least reference_m, 12, found 2",
        "run.yaml:8: 'air.gusts[0].gradient_m': expected a positive number, found 0",
        "run.yaml:9: 'air.gusts[1].towards': no direction of a gust 'north'",
        "run.yaml:10: 'air.turbulence.wind_at_20ft_mps': expected a number from 0 to 200, found -9.1",
        "run.yaml:10: 'air.turbulence.wind_at_20ft_mps': expected it or intensity, found both",
        "run.yaml:10: 'air.turbulence.intensity': no intensity of turbulence 'rough'",
        "run.yaml:11: 'air.atmosphere.temperature_offset_k': temperature: expected at most 60 K",
        "run.yaml:12: 'air.field.bands': expected two, wind towards east and towards north, found 1",
        "run.yaml:12: unknown key 'air.field.outsid'; did you mean 'outside'?"})
    EXPECT_NE(said.find(part), std::string::npos) << part << "\nin\n" << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 10) << "one line each:\n" << said;

  const auto of = [&](const std::string& what, const std::string& with) {
    return message(replaced(windy_run, what, with));
  };
  EXPECT_EQ(of("{wind_at_20ft_mps: 9.1}", "{}"), "run.yaml:10: expected the key 'air.turbulence.intensity'");
  EXPECT_EQ(of("from_deg: 270, ", ""), "run.yaml:5: expected the key 'air.wind.from_deg'");
  EXPECT_EQ(of("roughness_m: 0.05", "roughness_m: 12"),
            "run.yaml:6: 'air.shear.roughness_m': expected less than reference_m, 12, found 12");
  EXPECT_EQ(
      of("duration_s: 1", "environment: {earth: flat}\nduration_s: 1"),
      "run.yaml:12: 'air.atmosphere': has no effect over a flat Earth, whose density is constant: leave one of them "
      "out");
}

constexpr const char* mission_run = R"(duration_s: 1
scene: {layers: {eo: {map: m.tif}}}
vehicles:
  p:
    start: {lat_deg: 38.1, lon_deg: -0.76, height: 100 agl, yaw_deg: 30}
    turn_radius_m: 120
    mission:
      - {lat_deg: 38.11, lon_deg: -0.77, course_deg: 45, turn_radius_m: 90, airspeed_mps: 28}
      - orbit: {north_m: 10, east_m: 20, height: 150 msl, radius_m: 200, direction: left, turns: 2.5, airspeed_mps: 22}
      - survey:
          polygon: [{north_m: 0, east_m: 0}, {north_m: 900, east_m: 0}, {lat_deg: 38.12, lon_deg: -0.75}]
          height: 200 agl
          sensor: cam
          forward_overlap: 0.75
          side_overlap: 0.2
          heading_deg: 70
          lead_in_m: 50
          lead_out_m: 25
      - random:
          circle: {north_m: 0, east_m: 0, radius_m: 900}
          heights: [120 agl, 180 agl]
          turn_radius_m: [120, 240]
          airspeed_mps: [23, 27]
          max_slope: 0.05
          margin_m: 30
          length_m: 5000
      - random: {rectangle: {north_m: 0, east_m: 0, length_m: 3000, width_m: 1500, heading_deg: 20}}
      - orbit: {north_m: 0, east_m: 0, radius_m: 150, duration_s: 30}
    sensors:
      cam: {layer: eo, camera: c.yaml, rate_hz: survey}
)";

TEST_F(RunFileText, MissionsArriveWhereTheyBelongAndComeBackWhenWritten) {
  const RunFile run = read(mission_run).value();
  const test::TemporaryFolder elsewhere;
  const RunFile replay = read_run_file(elsewhere.write("replay.yaml", to_yaml(run))).value();
  EXPECT_EQ(to_yaml(replay), to_yaml(run));
  for (const VehicleSetup& p : {run.vehicles[0].second, replay.vehicles[0].second}) {
    EXPECT_EQ(p.start.place.geodetic->lat_deg, 38.1);
    EXPECT_TRUE(p.sensors[0].second.rate_of_survey);
    ASSERT_EQ(p.mission.size(), 6u);
    const auto& waypoint = std::get<WaypointSetup>(p.mission[0].what);
    EXPECT_EQ(waypoint.place.geodetic->lon_deg, -0.77);
    EXPECT_EQ(waypoint.course_deg, 45);
    EXPECT_EQ(waypoint.turn_radius_m, 90);
    EXPECT_EQ(waypoint.airspeed_mps, 28);
    EXPECT_EQ(waypoint.height.value_m, 100) << "the start's";
    const auto& orbit = std::get<OrbitSetup>(p.mission[1].what);
    EXPECT_EQ(orbit.center.east_m, 20);
    EXPECT_EQ(orbit.height.datum, HeightDatum::Msl);
    EXPECT_FALSE(orbit.clockwise || orbit.duration_s);
    EXPECT_EQ(orbit.turns, 2.5);
    const auto& survey = std::get<SurveySetup>(p.mission[2].what);
    const auto& corners = std::get<std::vector<PlaceSetup>>(survey.area);
    ASSERT_EQ(corners.size(), 3u);
    EXPECT_EQ(corners[1].north_m, 900);
    EXPECT_EQ(corners[2].geodetic->lat_deg, 38.12);
    EXPECT_EQ(survey.sensor, "cam");
    EXPECT_EQ(survey.forward_overlap, 0.75);
    EXPECT_EQ(survey.heading_deg, 70);
    EXPECT_EQ(survey.lead_out_m, 25);
    const auto& random = std::get<RandomPathSetup>(p.mission[3].what);
    EXPECT_EQ(std::get<DiscSetup>(random.area).radius_m, 900);
    EXPECT_EQ(random.heights.second.value_m, 180);
    EXPECT_EQ(random.turn_radius_m, std::pair(120.0, 240.0));
    EXPECT_EQ(random.airspeed_mps, std::pair(23.0, 27.0));
    EXPECT_EQ(random.length_m, 5000);
    const auto& plain = std::get<RandomPathSetup>(p.mission[4].what);
    EXPECT_EQ(std::get<RectangleSetup>(plain.area).heading_deg, 20);
    EXPECT_EQ(plain.heights.first.value_m, 120) << "the height before it";
    EXPECT_EQ(plain.turn_radius_m, std::pair(120.0, 120.0)) << "the vehicle's";
    EXPECT_EQ(std::get<OrbitSetup>(p.mission[5].what).duration_s, 30);
  }
}

TEST_F(RunFileText, EveryFaultOfAMissionIsToldWithItsLine) {
  std::string text = mission_run;
  for (const auto& [what, with] : {std::pair("lat_deg: 38.11,", "north_m: 3,"),
                                   {"radius_m: 200, direction: left, turns: 2.5", "direction: up, turns: -1"},
                                   {"{lat_deg: 38.12, lon_deg: -0.75}", "{lat_deg: 98.12, lon_deg: -0.75}"},
                                   {"sensor: cam", "sensor: cma"},
                                   {"forward_overlap: 0.75", "forward_overlap: 75"},
                                   {"heights: [120 agl, 180 agl]", "heights: [120 agl]"},
                                   {"turn_radius_m: [120, 240]", "turn_radius_m: [240, 120]"},
                                   {"length_m: 3000, width_m: 1500", "lenght_m: 3000, width_m: 1500"},
                                   {"duration_s: 30}", "duration_s: 30, turns: 1}"},
                                   {"rate_hz: survey", "rate_hz: survye"}})
    text = replaced(text, what, with);
  const std::string said = message(text);
  for (const char* part :
       {"run.yaml:8: expected the key 'vehicles.p.mission[0].lat_deg'",
        "run.yaml:8: 'vehicles.p.mission[0].north_m': expected none beside lat_deg and lon_deg",
        "run.yaml:9: expected the key 'vehicles.p.mission[1].orbit.radius_m'",
        "run.yaml:9: 'vehicles.p.mission[1].orbit.direction': expected right (clockwise) or left, found 'up'",
        "run.yaml:9: 'vehicles.p.mission[1].orbit.turns': expected a positive number, found -1",
        "run.yaml:11: 'vehicles.p.mission[2].survey.polygon[2].lat_deg': expected a number from -90 to 90",
        "run.yaml:13: 'vehicles.p.mission[2].survey.sensor': no sensor 'cma' of the vehicle; did you mean 'cam'?",
        "run.yaml:14: 'vehicles.p.mission[2].survey.forward_overlap': expected a number from 0 to 0.95, found 75",
        "run.yaml:21: 'vehicles.p.mission[3].random.heights': expected two such as [100 agl, 250 agl]",
        "run.yaml:22: 'vehicles.p.mission[3].random.turn_radius_m': expected two rising numbers above 0",
        "run.yaml:27: expected the key 'vehicles.p.mission[4].random.rectangle.length_m'",
        "run.yaml:27: unknown key 'vehicles.p.mission[4].random.rectangle.lenght_m'; did you mean 'length_m'?",
        "run.yaml:28: 'vehicles.p.mission[5].orbit.turns': expected it or duration_s, found both",
        "run.yaml:30: 'vehicles.p.sensors.cam.rate_hz': 'survye': expected a rate"})
    EXPECT_NE(said.find(part), std::string::npos) << part << "\nin\n" << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 13) << "one line each:\n" << said;

  const auto of = [&](const std::string& what, const std::string& with) {
    return message(replaced(mission_run, what, with));
  };
  EXPECT_NE(of("sensor: cam", "sensor: other").find("no survey of the mission names it"), std::string::npos);
  EXPECT_NE(of("circle: {north_m: 0, east_m: 0, radius_m: 900}", "height: 100")
                .find("expected the key "
                      "'vehicles.p.mission[3].random.polygon'"),
            std::string::npos);
  EXPECT_NE(of("          height: 200 agl", "          circle: {radius_m: 9}").find("expected one area, found several"),
            std::string::npos);
}

TEST_F(RunFileText, CutAtAnyByteItIsReadOrRefused) {
  const std::string text = full_run;
  int refused = 0;
  for (std::size_t n = 0; n < text.size(); n += 7) refused += !read(text.substr(0, n));
  EXPECT_GT(refused, static_cast<int>(text.find("air:")) / 7 - 5) << "nearly every cut before it loses duration_s";
}

TEST_F(RunFileText, AFileThatIsNotThereIsNamed) {
  const auto run = read_run_file(folder.file("gone.yaml"));
  ASSERT_FALSE(run);
  EXPECT_NE(run.error().message.find("gone.yaml"), std::string::npos);
}

}  // namespace
}  // namespace nadir::sim

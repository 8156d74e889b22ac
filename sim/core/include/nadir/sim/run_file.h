#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/geodesy/height.h"
#include "nadir/render/mount.h"
#include "nadir/render/quality.h"
#include "nadir/render/renderer.h"
#include "nadir/sim/air_setup.h"
#include "nadir/sim/autopilot_setup.h"
#include "nadir/sim/ground_setup.h"
#include "nadir/sim/integrator.h"
#include "nadir/sim/mission_setup.h"
#include "nadir/sim/multirotor_setup.h"
#include "nadir/sim/scheduler.h"
#include "nadir/sim/vehicle_file.h"
#include "nadir/tile/role.h"
#include "nadir/tile/sample_type.h"

namespace nadir::sim {

/// A map with what it means. Paths in a run file count from the run file's folder.
struct MapSetup {
  std::string map;
  std::optional<tile::Role> role;  // else the map's own, else optical
  std::vector<std::string> bands;  // numbers or names; all where empty
  std::optional<tile::RadarScale> radar_scale;
};

struct OriginSetup {
  double lat_deg = 0, lon_deg = 0;
  geodesy::TypedHeight height;
};

enum class SurfaceShape {
  Plane,      // tangent at the scene origin
  Ellipsoid,  // the curved Earth
};
std::string_view to_string(SurfaceShape shape);
Result<SurfaceShape> parse_surface_shape(std::string_view text);

struct SceneSetup {
  std::optional<OriginSetup> origin;  // else the first layer's centre at ground height
  SurfaceShape surface = SurfaceShape::Plane;
  geodesy::TypedHeight ground;                            // of the surface
  std::vector<std::pair<std::string, MapSetup>> layers;   // the sensor source: what cameras see
  std::vector<std::pair<std::string, MapSetup>> onboard;  // the onboard reference: what a navigation system carries
};

struct SensorSetup {
  std::string layer, camera;
  Rate rate;
  std::string rate_text = "1";
  bool rate_of_survey = false;                       // the rate is yet to follow from a survey: Run::prepare
  std::array<double, 3> mount_position_m{};          // forward, right, down
  std::array<double, 3> mount_yaw_pitch_roll_deg{};  // as typed: replaying a run must not lose a digit
  std::optional<tile::SampleType> output;            // else the layer's own
  std::optional<std::pair<double, double>> range;    // map values that become the output's lowest and highest
  render::OffMap off_map = render::OffMap::Mask;
  double fill_value = 0;
  render::Shutter shutter;
  bool allow_coarse = false;               // frames that do not wait for map tiles, and that no replay gives again
  std::optional<render::Quality> quality;  // else the run's
  std::optional<double> oversampling;      // else the quality's
  std::optional<double> time_budget_ms;    // of a frame; chooses quality and oversampling: Run::fit_time_budgets
  bool adaptive = false;                   // chooses them anew for each frame, and no longer the same in each run
  std::optional<double> fitted_to_ms;      // the budget that they were resolved from; decides nothing

  render::Mount mount() const;
};

struct VehicleSetup {
  std::string model = "aerosonde";              // of vehicle_models(); or "poses": where a file says
  std::optional<VehicleParameters> parameters;  // in place of the model's
  AutopilotSetup autopilot;
  std::string poses;  // of model poses
  WaypointSetup start;
  double yaw_deg = 0;
  double airspeed_mps = 25;               // the model's own unless told
  std::vector<MissionItemSetup> mission;  // where empty: straight on
  double turn_radius_m = 150;
  bool repeat_mission = false;                // else a circle at the end
  GroundSetup ground;                         // of a fixed wing: how it leaves it and comes back
  std::optional<MultirotorSetup> multirotor;  // of that kind, instead of mission, airspeed and turn radius
  double trajectory_tolerance_m = 1e-3;       // of what steps of the motion make of it
  std::optional<Scheme> integration;          // else the cheapest within that tolerance: plan_motion
  std::vector<std::pair<std::string, SensorSetup>> sensors;

  // Of the parameters or the model; there must be one, and of that kind
  VehicleParameters vehicle() const;
  FixedWing fixed_wing() const;
  Multirotor multirotor_vehicle() const;
};

enum class TelemetryFormat {
  None,
  Csv,
  Npy,  // records of a NumPy array
};
std::string_view to_string(TelemetryFormat format);
Result<TelemetryFormat> parse_telemetry_format(std::string_view text);

/// Everything that a run depends on. Read from YAML with every key checked; written back complete with defaults, so
/// that it can be replayed to the same bytes.
struct RunFile {
  std::uint64_t seed = 0;
  std::string epoch_utc = "2000-01-01T00:00:00Z";
  std::int64_t duration_ns = 0;
  std::string duration_text;
  SceneSetup scene;
  std::vector<std::pair<std::string, VehicleSetup>> vehicles;

  bool flat_earth = false;  // g = 9.81, constant density: the textbook's world, for comparison with its numbers
  AirSetup air;

  render::Quality quality = render::Quality::balanced;
  double geometry_tolerance_px = 0.05;

  bool record_frames = true, record_report = true;
  bool record_truth_rows = false, record_truth_planes = false;
  TelemetryFormat telemetry = TelemetryFormat::Csv;
  Rate telemetry_rate = {50, 1'000'000'000};
  std::string telemetry_rate_text = "50";

  std::filesystem::path file;    // the run file, for messages
  std::filesystem::path folder;  // of the run file: where relative paths count from
  std::filesystem::path resolve(const std::string& path) const { return (folder / path).lexically_normal(); }
};

/// All faults of the file in one message, each with its line.
Result<RunFile> read_run_file(const std::filesystem::path& path);

/// Complete with defaults; map and camera paths absolute, so that it can be replayed from anywhere.
std::string to_yaml(const RunFile& run);

}  // namespace nadir::sim

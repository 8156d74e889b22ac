#include "nadir/sim/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>

#include "nadir/base/time.h"
#include "nadir/render/adaptive_quality.h"
#include "nadir/sim/scene_setup.h"
#include "pose_sources.h"

namespace nadir::sim {
namespace {

Result<std::vector<std::pair<std::string, tile::Map>>> open_maps(
    const RunFile& file, const std::vector<std::pair<std::string, MapSetup>>& setups) {
  std::vector<std::pair<std::string, tile::Map>> maps;
  for (const auto& [name, setup] : setups) {
    auto map = tile::Map::open(file.resolve(setup.map).string());
    if (!map) return fail(map.error().kind, fmt::format("layer {}: {}", name, map.error().message));
    maps.emplace_back(name, std::move(*map));
  }
  return maps;
}

Result<PreparedSensor> prepare_sensor(const RunFile& file, const render::Surface& ground,
                                      const std::vector<std::pair<std::string, tile::Map>>& layers,
                                      const std::string& vehicle, const std::string& name, const SensorSetup& setup) {
  auto camera = render::Camera::from_yaml(file.resolve(setup.camera));
  if (!camera) return fail(camera);
  camera->set_name(name);
  std::size_t i = 0;
  while (layers[i].first != setup.layer) ++i;  // the run file was checked
  const tile::Map& map = layers[i].second;
  auto options = layer_options(map, file.scene.layers[i].second, setup.output, setup.range);
  if (!options) return fail(options.error().kind, fmt::format("sensor {}: {}", name, options.error().message));
  render::Scene scene = render::Scene::over(ground).with_layer(name, map, std::move(*options));
  if (auto ok = scene.check(); !ok)
    return fail(ok.error().kind, fmt::format("sensor {}: {}", name, ok.error().message));
  return PreparedSensor{vehicle,          name, setup, std::move(*camera), render::body_from_camera(setup.mount()),
                        std::move(scene), {}};
}

std::vector<VehicleCamera> cameras_of(std::span<const PreparedSensor> sensors) {
  std::vector<VehicleCamera> cameras;
  for (const PreparedSensor& s : sensors) cameras.push_back({s.name, &s.camera, s.body_from_camera});
  return cameras;
}

/// The rate that a sensor's surveys ask for, rounded up to thousandths, within what rates can be.
void take_rate(const PlannedMission& plan, const std::string& name, SensorSetup& sensor) {
  double rate_hz = 1e-3;
  for (const PlannedSurvey& survey : plan.surveys)
    if (survey.sensor == name) rate_hz = std::max(rate_hz, survey.rate_hz);
  sensor.rate_text = fmt::format("{:.3f}", std::min(std::ceil(rate_hz * 1000) / 1000, 1e6));
  sensor.rate = Rate::parse_hz(sensor.rate_text).value();
  sensor.rate_of_survey = false;
}

/// The plan of a vehicle that is flown, by its kind.
Result<void> plan_of(const RunFile& file, const VehicleSetup& setup, const render::Surface& ground,
                     std::span<const VehicleCamera> cameras, PreparedVehicle& vehicle) {
  const auto take = [](auto plan, auto& out) -> Result<void> {
    if (!plan) return fail(plan);
    out = std::move(*plan);
    return {};
  };
  if (setup.multirotor)
    return take(plan_multirotor_mission(file, vehicle.name, setup, ground, cameras), vehicle.multirotor_plan);
  return take(plan_mission(file, vehicle.name, setup, ground, cameras), vehicle.plan);
}

Result<std::unique_ptr<PoseSource>> source_of(const RunFile& file, const VehicleSetup& setup,
                                              const render::Surface& ground, const PreparedVehicle& vehicle) {
  if (vehicle.multirotor_plan)
    return make_multirotor_flight(file, vehicle.name, setup, *vehicle.multirotor_plan, ground);
  if (vehicle.plan) return make_flight(file, vehicle.name, setup, *vehicle.plan, ground);
  return make_recorded_poses(file, setup, ground);
}

/// No vehicle keeps its velocity for longer.
constexpr double longest_foresight_s = 2;

/// Where the camera is some time after a state (before, where negative), if the vehicle keeps its velocity and its
/// rates.
render::CameraPose pose_after(const VehicleState& state, const PreparedSensor& sensor, double time_s) {
  geodesy::Pose<geodesy::frame::Ecef, geodesy::frame::Body> body = state.ecef_from_body;
  body.origin += time_s * state.twist.velocity_ecef_mps;
  body.rotation = (body.rotation * render::rotation_by(time_s * state.twist.rates_radps)).normalized();
  return body * sensor.body_from_camera;
}

}  // namespace

Result<Run> Run::prepare(const RunFile& file) {
  auto layers = open_maps(file, file.scene.layers);
  if (!layers) return fail(layers);
  auto onboard = open_maps(file, file.scene.onboard);
  if (!onboard) return fail(onboard);
  if (layers->empty()) return fail(Error::Kind::Malformed, "the scene has no layer: name a map under scene.layers");
  const auto ground = ground_surface(file.scene.surface, file.scene.origin, file.scene.ground, layers->front().second);
  if (!ground) return fail(ground);

  Run run(file, *ground);
  std::string faults;  // of missions: all of them
  for (auto& [name, setup] : run.file_.vehicles) {
    const std::size_t first = run.sensors_.size();
    for (const auto& [sensor_name, sensor] : setup.sensors) {
      auto prepared = prepare_sensor(file, *ground, *layers, name, sensor_name, sensor);
      if (!prepared) return fail(prepared);
      run.sensors_.push_back(std::move(*prepared));
    }
    const std::span sensors = std::span(run.sensors_).subspan(first);
    PreparedVehicle vehicle{name, {}, {}, {}};
    if (setup.model != "poses")
      if (auto ok = plan_of(file, setup, *ground, cameras_of(sensors), vehicle); !ok) {
        faults += (faults.empty() ? "" : "\n") + ok.error().message;
        continue;
      }
    for (std::size_t i = 0; i < sensors.size(); ++i)
      if (setup.sensors[i].second.rate_of_survey) {
        take_rate(*vehicle.planned(), setup.sensors[i].first, setup.sensors[i].second);
        sensors[i].setup = setup.sensors[i].second;
      }
    auto source = source_of(file, setup, *ground, vehicle);
    if (!source) return fail(source.error().kind, fmt::format("vehicle {}: {}", name, source.error().message));
    if (const MotionPlan* motion = (*source)->motion_plan()) setup.integration = motion->scheme;
    vehicle.source = std::move(*source);
    run.vehicles_.push_back(std::move(vehicle));
  }
  if (!faults.empty()) return fail(Error::Kind::Malformed, faults);
  run.layers_ = std::move(*layers);
  run.onboard_ = std::move(*onboard);
  return run;
}

const PreparedSensor& Run::sensor(std::string_view vehicle, std::string_view name) const {
  const auto found = std::find_if(sensors_.begin(), sensors_.end(),
                                  [&](const PreparedSensor& s) { return s.vehicle == vehicle && s.name == name; });
  assert(found != sensors_.end());
  return *found;
}

const PreparedVehicle& Run::vehicle(std::string_view name) const {
  const auto found =
      std::find_if(vehicles_.begin(), vehicles_.end(), [&](const PreparedVehicle& v) { return v.name == name; });
  assert(found != vehicles_.end());
  return *found;
}

render::RenderOptions Run::render_options(const PreparedSensor& sensor) const {
  return {.quality = sensor.setup.quality.value_or(file_.quality),
          .oversampling = sensor.setup.oversampling,
          .geometry_tolerance_px = file_.geometry_tolerance_px,
          .off_map = sensor.setup.off_map,
          .fill_value = sensor.setup.fill_value,
          .allow_coarse = sensor.setup.allow_coarse};
}

render::CameraPose camera_pose(const VehicleState& state, const PreparedSensor& sensor) {
  return state.ecef_from_body * sensor.body_from_camera;
}

render::CameraMotion camera_motion(const VehicleState& state, const PreparedSensor& sensor) {
  const double half_s = (sensor.setup.shutter.exposure_s + sensor.setup.shutter.readout_s) / 2;
  std::vector<render::Moment> moments;
  for (const double t : {-half_s, half_s}) moments.push_back({t, pose_after(state, sensor, t)});
  return render::CameraMotion::through(std::move(moments)).value();
}

Result<render::Frame> render_frame(render::Renderer& renderer, const VehicleState& state, const PreparedSensor& sensor,
                                   const render::RenderOptions& options) {
  if (sensor.setup.shutter.instant())
    return renderer.render(sensor.scene, sensor.camera, camera_pose(state, sensor), options);
  return renderer.render(sensor.scene, sensor.camera, camera_motion(state, sensor), sensor.setup.shutter, options);
}

render::ExactChain exact_chain(const VehicleState& state, const PreparedSensor& sensor) {
  if (sensor.setup.shutter.instant()) return {sensor.camera, camera_pose(state, sensor), sensor.scene.surface()};
  return {sensor.camera, camera_motion(state, sensor), sensor.setup.shutter, sensor.scene.surface()};
}

std::vector<PlannedPoint> planned_path(const RunFile& run, const PreparedVehicle& vehicle) {
  constexpr double spacing_m = 10;
  if (vehicle.multirotor_plan) return planned_path(*vehicle.multirotor_plan, seconds_from_ns(run.duration_ns));
  return vehicle.plan ? planned_path(*vehicle.plan, spacing_m) : std::vector<PlannedPoint>();
}

std::string in_words(const RunEvent& event) {
  return fmt::format("vehicle {}: {}", event.vehicle, in_words(event.event));
}

const RunEvent* RunSummary::ended() const {
  for (const RunEvent& event : events)
    if (event.event.ends_flight) return &event;
  return nullptr;
}

Result<RunSummary> Run::execute(render::Renderer& renderer, std::span<Sink* const> sinks, bool render_frames,
                                double pace) {
  if (render_frames)
    if (auto ok = fit_time_budgets(renderer); !ok) return fail(ok);
  Scheduler scheduler;
  RunSummary summary;
  for (const PreparedVehicle& vehicle : vehicles_) {
    vehicle.source->schedule(scheduler);
    scheduler.add(Scheduler::Stage::Observe, file_.telemetry_rate,
                  [&, &vehicle = vehicle](std::int64_t time_ns) -> Result<void> {
                    const auto state = vehicle.source->state_at(time_ns);
                    if (!state) return fail(state);
                    for (Sink* sink : sinks)
                      if (auto ok = sink->on_state(vehicle.name, *state); !ok) return ok;
                    return {};
                  });
  }
  for (const PreparedSensor& sensor : sensors_) {
    const PoseSource* source = vehicle(sensor.vehicle).source.get();
    std::optional<render::AdaptiveQuality> adaptive;
    if (render_frames && sensor.setup.adaptive) adaptive.emplace(*sensor.fitted);
    scheduler.add(
        Scheduler::Stage::Observe, sensor.setup.rate,
        [&, source, first = true, adaptive,
         coming = std::make_shared<tile::CellCache::Ticket>()](std::int64_t time_ns) mutable -> Result<void> {
          const auto state = source->state_at(time_ns);
          if (!state) return fail(state);
          std::optional<render::Frame> frame;
          std::string rejected;
          if (render_frames) {
            render::RenderOptions options = render_options(sensor);
            if (adaptive) options = adaptive->options(options);
            options.explain = first;
            auto rendered = render_frame(renderer, *state, sensor, options);
            const double period_s = 1 / sensor.setup.rate.hz();
            if (period_s <= longest_foresight_s)
              *coming = renderer.prefetch(sensor.scene, sensor.camera, pose_after(*state, sensor, period_s), options);
            if (!rendered && rendered.error().kind != Error::Kind::OutsideMap)
              return fail(rendered.error().kind,
                          fmt::format("sensor {} at {} ns: {}", sensor.name, time_ns, rendered.error().message));
            if (rendered) {
              if (first) {
                if (sensor.fitted)
                  summary.plan_done.push_back(fmt::format("{}: {}", sensor.name, to_string(*sensor.fitted)));
                const render::ExplanationText text = render::to_text(rendered->explanation());
                summary.plan_done.insert(summary.plan_done.end(), text.done.begin(), text.done.end());
                summary.plan_left_out.insert(summary.plan_left_out.end(), text.left_out.begin(), text.left_out.end());
              }
              first = false;
              ++summary.frames;
              const double render_ms = rendered->truth().render_ms;
              if (adaptive) adaptive->note(render_ms);
              summary.late += sensor.fitted && render_ms > sensor.fitted->budget_ms;
              const auto& coarse = rendered->truth().coarse;
              summary.coarse += coarse && coarse->fraction > 0;
              const auto& damage = rendered->truth().damage;
              summary.damaged += !damage.empty();
              summary.damage.insert(damage.begin(), damage.end());
              frame = std::move(*rendered);
            } else {
              ++summary.rejected;
              rejected = rendered.error().message;
            }
          }
          const render::Truth truth =
              frame ? frame->truth()
                    : render::geometric_truth(exact_chain(*state, sensor), sensor.scene.layers().front().source->map());
          const FrameEvent event{sensor.vehicle, sensor.name, *state, frame ? &*frame : nullptr, truth, rejected};
          for (Sink* sink : sinks)
            if (auto ok = sink->on_frame(event); !ok) return ok;
          return {};
        });
  }
  const auto start = std::chrono::steady_clock::now();
  auto done = scheduler.run(file_.duration_ns, pace);
  for (Sink* sink : sinks)  // after a failure too: what was told until then is whole
    if (auto ok = sink->finish(); !ok && done) done = ok;
  if (!done) return fail(done);
  summary.flown_ns = scheduler.end_ns();
  for (const PreparedVehicle& vehicle : vehicles_)
    for (const FlightEvent& event : vehicle.source->events())
      if (event.time_ns <= summary.flown_ns) summary.events.push_back({vehicle.name, event});
  std::stable_sort(summary.events.begin(), summary.events.end(),
                   [](const RunEvent& a, const RunEvent& b) { return a.event.time_ns < b.event.time_ns; });
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace nadir::sim

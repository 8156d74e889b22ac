#pragma once

#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/render/renderer.h"
#include "nadir/render/time_budget.h"
#include "nadir/sim/flight_plan.h"
#include "nadir/sim/pose_source.h"
#include "nadir/sim/run_file.h"
#include "nadir/sim/sink.h"

namespace nadir::sim {

/// A sensor, ready to be rendered.
struct PreparedSensor {
  std::string vehicle, name;
  SensorSetup setup;
  render::Camera camera;
  geodesy::Pose<geodesy::frame::Body, geodesy::frame::Camera> body_from_camera;
  render::Scene scene;                          // with one layer, of the sensor's name
  std::optional<render::FittedQuality> fitted;  // of its time budget, once that is resolved
};

struct PreparedVehicle {
  std::string name;
  std::unique_ptr<PoseSource> source;
  std::optional<FlightPlan> plan;  // of a fixed wing
  std::optional<MultirotorPlan> multirotor_plan;

  /// Of one that is flown.
  const PlannedMission* planned() const {
    if (plan) return &*plan;
    return multirotor_plan ? &*multirotor_plan : nullptr;
  }
};

/// The path that a vehicle is to fly, in steps of 10 m or half a second; one without end as far as the run lasts.
/// Empty where it is not flown.
std::vector<PlannedPoint> planned_path(const RunFile& run, const PreparedVehicle& vehicle);

struct RunEvent {
  std::string vehicle;
  FlightEvent event;
};
std::string in_words(const RunEvent& event);

/// What a run cost and saw.
struct RunSummary {
  std::int64_t flown_ns = 0;  // the duration, or until a flight ended early
  std::vector<RunEvent> events;
  const RunEvent* ended() const;  // what ended it early; none where nothing did
  std::int64_t frames = 0, rejected = 0;
  std::int64_t coarse = 0;                            // frames with pixels from coarser levels than planned
  std::int64_t late = 0;                              // frames over their sensor's time budget
  std::size_t damaged = 0;                            // frames that saw damaged tiles
  std::set<std::string> damage;                       // those tiles, each once
  double seconds = 0;                                 // of the machine's clock
  std::vector<std::string> plan_done, plan_left_out;  // of the first frame of each sensor
};

/// A run file made into maps, cameras, vehicles and scenes: all that can fail before the first step has been tried.
/// Faults of all missions are told in one message. Rates that follow from surveys are in file() as numbers.
class Run {
 public:
  static Result<Run> prepare(const RunFile& file);

  const RunFile& file() const { return file_; }
  const render::Surface& ground() const { return ground_; }
  const std::vector<PreparedSensor>& sensors() const { return sensors_; }
  const PreparedSensor& sensor(std::string_view vehicle, std::string_view name) const;  // there must be one
  const std::vector<PreparedVehicle>& vehicles() const { return vehicles_; }
  const PreparedVehicle& vehicle(std::string_view name) const;  // there must be one
  const std::vector<std::pair<std::string, tile::Map>>& layers() const { return layers_; }
  const std::vector<std::pair<std::string, tile::Map>>& onboard() const { return onboard_; }

  /// Resolves the time budgets of sensors, by rendering a few frames spread over the flight: those of sensors that are
  /// not adaptive become settings, of file() too, which then makes the same bytes however long frames take. What is
  /// resolved stays. `then` takes the frames tried.
  Result<void> fit_time_budgets(render::Renderer& renderer, const render::TriedFrames& then = {});

  /// Flies it once, with time budgets resolved before the first frame. `render_frames`: else only states are told.
  /// `pace`: as Scheduler::run has it.
  Result<RunSummary> execute(render::Renderer& renderer, std::span<Sink* const> sinks, bool render_frames, double pace);

  /// Of a sensor that is adaptive, all but the way of sampling.
  render::RenderOptions render_options(const PreparedSensor& sensor) const;

 private:
  Run(RunFile file, render::Surface ground) : file_(std::move(file)), ground_(std::move(ground)) {}
  RunFile file_;
  render::Surface ground_;
  std::vector<std::pair<std::string, tile::Map>> layers_, onboard_;
  std::vector<PreparedSensor> sensors_;
  std::vector<PreparedVehicle> vehicles_;
};

/// The pose of a sensor's camera on a vehicle.
render::CameraPose camera_pose(const VehicleState& state, const PreparedSensor& sensor);

/// How a sensor's camera moves around the stamp of its frame: on the vehicle, which keeps its velocity and its rates.
/// Of an acceleration a, that leaves out a t^2 / 2 at a time t from the stamp: 3 mm at 10 m/s^2 and 25 ms; of the arc
/// of a camera r metres beside the vehicle's origin, its height over the chord: r (w t)^2 / 2, 0.3 mm at 1 m and 1
/// rad/s. Its shutter is not instant.
render::CameraMotion camera_motion(const VehicleState& state, const PreparedSensor& sensor);

Result<render::Frame> render_frame(render::Renderer& renderer, const VehicleState& state, const PreparedSensor& sensor,
                                   const render::RenderOptions& options);

/// From a sensor's pixels to the ground.
render::ExactChain exact_chain(const VehicleState& state, const PreparedSensor& sensor);

}  // namespace nadir::sim

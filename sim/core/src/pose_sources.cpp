#include "pose_sources.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "flight_parts.h"
#include "nadir/base/time.h"
#include "nadir/sim/plan_motion.h"
#include "nadir/sim/pose_file.h"

namespace nadir::sim {
namespace {

using namespace geodesy;

const Rate period_rate{1, Flight::period_ns};

class FlownPoses final : public PoseSource {
 public:
  FlownPoses(Flight flight, MotionPlan plan) : flight_(std::move(flight)), plan_(std::move(plan)) {}

  void schedule(Scheduler& scheduler) override {
    scheduler.add(Scheduler::Stage::Decide, period_rate, [this](std::int64_t) { return flight_.decide(); });
    scheduler.add(Scheduler::Stage::Move, period_rate, [this, &scheduler](std::int64_t) -> Result<void> {
      if (auto ok = flight_.move(); !ok) return ok;
      if (const FlightEvent* event = flight_.ended()) scheduler.end_at(event->time_ns);
      return {};
    });
  }

  Result<VehicleState> state_at(std::int64_t time_ns) const override {
    const auto now = flight_.at(time_ns);
    if (!now) return fail(now);
    const BodyState& body = now->body;
    VehicleState state = vehicle_state(time_ns, {body.ecef_from_body.quaternion, body.position.xyz});
    const Eigen::Vector3d earth_rate = flight_.environment().at(body.position).earth_rate_ecef_radps;
    state.twist = {body.velocity.xyz, body.body_rates_radps - body.ecef_from_body.quaternion.conjugate() * earth_rate};
    state.flight = now->data;
    return state;
  }

  std::span<const std::string> channels() const override { return flight_.vehicle().channels(); }
  const MotionPlan* motion_plan() const override { return &plan_; }
  std::span<const FlightEvent> events() const override { return flight_.events(); }

 private:
  Flight flight_;
  MotionPlan plan_;
};

/// Its poses cover the whole run.
class RecordedPoses final : public PoseSource {
 public:
  explicit RecordedPoses(std::vector<TimedPose> poses) : poses_(std::move(poses)) {}

  void schedule(Scheduler&) override {}

  Result<VehicleState> state_at(std::int64_t time_ns) const override {
    assert(time_ns >= poses_.front().time_ns && time_ns <= poses_.back().time_ns);
    while (poses_[at_ + 1 < poses_.size() ? at_ + 1 : at_].time_ns <= time_ns && at_ + 1 < poses_.size()) ++at_;
    const render::CameraPose& a = poses_[at_].ecef_from_camera;
    render::CameraPose pose = a;
    if (poses_[at_].time_ns != time_ns) {
      const TimedPose& next = poses_[at_ + 1];
      const double s =
          static_cast<double>(time_ns - poses_[at_].time_ns) / static_cast<double>(next.time_ns - poses_[at_].time_ns);
      pose = {a.rotation.slerp(s, next.ecef_from_camera.rotation),
              a.origin + s * (next.ecef_from_camera.origin - a.origin)};
    }
    VehicleState state = vehicle_state(time_ns, pose * render::body_from_camera({}).inverse());
    state.twist = twist();
    return state;
  }

 private:
  /// From here to the next pose; from the last one on, as it was until there.
  Twist twist() const {
    if (poses_.size() < 2) return {};
    const std::size_t from = std::min(at_, poses_.size() - 2);
    const auto body_at = [&](std::size_t i) {
      return poses_[i].ecef_from_camera * render::body_from_camera({}).inverse();
    };
    const auto a = body_at(from), b = body_at(from + 1);
    const double duration_s = seconds_from_ns(poses_[from + 1].time_ns - poses_[from].time_ns);
    return {(b.origin - a.origin) / duration_s,
            render::rotation_vector(a.rotation.conjugate() * b.rotation) / duration_s};
  }

  const std::vector<TimedPose> poses_;
  mutable std::size_t at_ = 0;  // times never fall
};

/// How the motion is stepped: as told, else the cheapest way within the tolerance.
Result<MotionPlan> motion_plan(const MakeFlight& make, const VehicleSetup& setup, std::int64_t duration_ns) {
  if (setup.integration) return MotionPlan{*setup.integration, "as the run file says"};
  constexpr std::int64_t longest_trial_ns = 60'000'000'000;
  if (auto flown = make({}); !flown) return fail(flown);  // what cannot begin is no fault of a scheme
  auto plan = plan_motion(make, setup.trajectory_tolerance_m, std::min(duration_ns, longest_trial_ns));
  if (!plan) return fail(plan);
  return MotionPlan{plan->scheme, plan->why};
}

}  // namespace

Result<Environment> environment_of(const RunFile& run, const LocalFrame& scene, const Geodetic& place) {
  if (run.flat_earth) return Environment::flat(scene.origin());
  const auto sea_level_m = geoid_height_m(place.lat_rad, place.lon_rad);
  if (!sea_level_m) return fail(sea_level_m);
  return Environment::wgs84(*sea_level_m, Atmosphere(run.air.atmosphere));
}

Result<std::unique_ptr<PoseSource>> planned_flight(const MakeFlight& make, const VehicleSetup& setup,
                                                   std::int64_t duration_ns) {
  const auto plan = motion_plan(make, setup, duration_ns);
  if (!plan) return fail(plan);
  auto flight = make(plan->scheme);
  if (!flight) return fail(flight);
  return std::make_unique<FlownPoses>(std::move(*flight), *plan);
}

Result<std::unique_ptr<PoseSource>> make_recorded_poses(const RunFile& run, const VehicleSetup& setup,
                                                        const render::Surface& ground) {
  const std::filesystem::path path = run.resolve(setup.poses);
  auto poses = read_pose_file(path, ground, {});
  if (!poses) return fail(poses);
  const std::int64_t first_ns = poses->front().time_ns, last_ns = poses->back().time_ns;
  if (first_ns > 0 || last_ns < run.duration_ns)
    return fail(
        Error::Kind::Malformed,
        fmt::format(
            "{}: has poses from {} s to {} s, and the run needs them from 0 s to {} s: change duration_s or the file",
            path.string(), seconds_from_ns(first_ns), seconds_from_ns(last_ns), run.duration_text));
  return std::make_unique<RecordedPoses>(std::move(*poses));
}

}  // namespace nadir::sim

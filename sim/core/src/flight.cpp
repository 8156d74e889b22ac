#include "flight.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "nadir/sim/air_along_path.h"
#include "nadir/sim/flown_fixed_wing.h"
#include "nadir/sim/plan_flight.h"
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
    const double duration_s = static_cast<double>(poses_[from + 1].time_ns - poses_[from].time_ns) * 1e-9;
    return {(b.origin - a.origin) / duration_s,
            render::rotation_vector(a.rotation.conjugate() * b.rotation) / duration_s};
  }

  const std::vector<TimedPose> poses_;
  mutable std::size_t at_ = 0;  // times never fall
};

/// Height above the tangent plane at the scene origin of a typed height. `msl` and `ellipsoid` are taken at the origin.
Result<double> height_in_scene_m(const TypedHeight& height, const render::Surface& ground) {
  const Geodetic& origin = ground.frame().origin();
  const auto ellipsoidal_m = ellipsoidal_height_m(height, origin.lat_rad, origin.lon_rad, ground.height_m());
  if (!ellipsoidal_m) return ellipsoidal_m;
  return *ellipsoidal_m - origin.height_m;
}

Result<Waypoint> in_scene(const WaypointSetup& setup, const render::Surface& ground) {
  const auto height_m = height_in_scene_m(setup.height, ground);
  if (!height_m) return fail(height_m);
  return Waypoint{setup.north_m, setup.east_m, *height_m};
}

/// Of a place, along the normal of the ground.
double height_above_ground_m(const render::Surface& ground, const Point<frame::Ecef>& place) {
  if (ground.plane()) return (ground.frame().enu_from_ecef() * place).xyz.z() - ground.up_m();
  return geodetic_from_ecef(place).height_m - ground.height_m();
}

/// What moves the air around one vehicle. Its turbulence is its own, by its name.
Result<AirParts> make_air(const RunFile& run, const std::string& name, double span_m, const render::Surface& ground) {
  const AirSetup& air = run.air;
  AirParts parts;
  parts.height_above_ground_m = [ground](const Point<frame::Ecef>& place) {
    return height_above_ground_m(ground, place);
  };
  parts.sources.push_back(std::make_unique<SteadyWind>(
      wind_towards_ned_mps(to_radians(air.wind_from_deg), air.wind_speed_mps, air.wind_up_mps), air.shear));
  if (air.field) {
    auto map = tile::Map::open(run.resolve(air.field->map).string());
    if (!map) return fail(map.error().kind, fmt::format("air.field: {}", map.error().message));
    auto wind = MapWind::create(std::move(*map), air.field->bands, air.field->outside);
    if (!wind) return fail(wind.error().kind, fmt::format("air.field: {}", wind.error().message));
    parts.sources.push_back(std::make_unique<MapWind>(std::move(*wind)));
  }
  parts.gusts = air.gusts;
  if (air.turbulence)
    parts.turbulence =
        Turbulence(air.turbulence->wind_at_20ft_mps(), span_m, RandomStream(run.seed, "turbulence/" + name));
  return parts;
}

/// How the motion is stepped: as told, else the cheapest way within the tolerance.
Result<MotionPlan> motion_plan(const MakeFlight& make, const VehicleSetup& setup, std::int64_t duration_ns) {
  if (setup.integration) return MotionPlan{*setup.integration, "as the run file says"};
  constexpr std::int64_t longest_trial_ns = 60'000'000'000;
  if (auto flown = make({}); !flown) return fail(flown);  // what cannot begin is no fault of a scheme
  auto plan = plan_flight(make, setup.trajectory_tolerance_m, std::min(duration_ns, longest_trial_ns));
  if (!plan) return fail(plan);
  return MotionPlan{plan->scheme, plan->why};
}

}  // namespace

Result<std::unique_ptr<PoseSource>> make_flight(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                                                const render::Surface& ground) {
  const FixedWing vehicle = aerosonde();
  const auto start = in_scene(setup.start, ground);
  if (!start) return fail(start);
  const double over_ground_m = start->height_m - ground.up_m();
  if (over_ground_m < 0)
    return fail(
        Error::Kind::Malformed,
        fmt::format("start: expected a height on the ground or above it, found {:.1f} m over it", over_ground_m));
  const bool on_ground = over_ground_m < 1e-3;
  const LocalFrame& scene = ground.frame();
  const Geodetic place =
      geodetic_from_ecef(scene.ecef_from_enu() * Point<frame::Enu>{{start->east_m, start->north_m, start->height_m}});

  double sea_level_m = 0;
  if (!run.flat_earth) {
    const auto geoid_m = geoid_height_m(place.lat_rad, place.lon_rad);
    if (!geoid_m) return fail(geoid_m);
    sea_level_m = *geoid_m;
  }
  const Environment environment = run.flat_earth ? Environment::flat(scene.origin())
                                                 : Environment::wgs84(sea_level_m, Atmosphere(run.air.atmosphere));
  std::vector<Waypoint> waypoints;
  for (const WaypointSetup& point : setup.mission) {
    const auto waypoint = in_scene(point, ground);
    if (!waypoint) return fail(waypoint);
    waypoints.push_back(*waypoint);
  }
  const double yaw_rad = to_radians(setup.yaw_deg);
  const auto on = ground_flight(setup.ground, gear_of(setup.model), ground, *start, yaw_rad, on_ground);
  if (!on) return fail(on);
  Waypoint mission_start = *start;
  if (on->takeoff) mission_start.height_m += on->takeoff->clear_m;
  if (on->landing)
    for (const Waypoint& gate : approach(*on->landing, setup.ground.land->straight_m)) waypoints.push_back(gate);
  if (waypoints.empty()) {  // straight on, farther than the run lasts
    const double reach_m = (setup.airspeed_mps + 100) * (static_cast<double>(run.duration_ns) * 1e-9 + 10);
    waypoints.push_back({start->north_m + reach_m * std::cos(yaw_rad), start->east_m + reach_m * std::sin(yaw_rad),
                         mission_start.height_m});
  }
  auto mission = Mission::create(mission_start, waypoints, setup.turn_radius_m,
                                 setup.repeat_mission ? AfterMission::Repeat : AfterMission::Circle);
  if (!mission) return fail(mission);

  const MakeFlight make = [&](const Scheme& scheme) -> Result<Flight> {
    auto parts = make_air(run, name, vehicle.span_m, ground);
    if (!parts) return fail(parts);
    auto air = AirAlongPath::start(std::move(*parts), ecef_from_geodetic(place),
                                   {std::cos(yaw_rad), std::sin(yaw_rad), 0}, setup.airspeed_mps);
    if (!air) return fail(air);
    auto flown = fly_fixed_wing({.vehicle = vehicle,
                                 .environment = environment,
                                 .scene = scene,
                                 .start = place,
                                 .yaw_rad = yaw_rad,
                                 .airspeed_mps = setup.airspeed_mps,
                                 .wind_ned_mps = air->air().end().velocity_ned_mps,
                                 .mission = *mission,
                                 .ground = *on,
                                 .tolerance_m = setup.trajectory_tolerance_m,
                                 .scheme = scheme});
    if (!flown) return fail(flown);
    return Flight(environment, std::move(*air), std::move(*flown));
  };
  const auto plan = motion_plan(make, setup, run.duration_ns);
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
            path.string(), static_cast<double>(first_ns) * 1e-9, static_cast<double>(last_ns) * 1e-9,
            run.duration_text));
  return std::make_unique<RecordedPoses>(std::move(*poses));
}

}  // namespace nadir::sim

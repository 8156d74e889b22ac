#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "nadir/sim/flown_multirotor.h"
#include "nadir/sim/multirotor_ground.h"
#include "scene_place.h"
#include "survey_plan.h"
#include "vehicle_kind.h"

namespace nadir::sim {
namespace {

using Eigen::Vector2d;
using geodesy::to_radians;

constexpr double on_ground_m = 0.01;  // a start that is no higher stands

/// Adds items to a mission, one after the other.
class MultirotorPlanner {
 public:
  MultirotorPlanner(const RunFile& run, const VehicleSetup& setup, const render::Surface& ground,
                    std::span<const VehicleCamera> cameras)
      : run_(run), setup_(setup), ground_(ground), cameras_(cameras) {}

  Result<void> begin();
  Result<void> add(std::size_t item, const WaypointSetup& setup);
  Result<void> add(std::size_t item, const SurveySetup& setup);
  Result<void> add(std::size_t, const OrbitSetup&) { return not_flown(); }
  Result<void> add(std::size_t, const RandomPathSetup&) { return not_flown(); }

  MultirotorPlan plan;

 private:
  static Result<void> not_flown() {
    return fail(Error::Kind::Unsupported, "expected a waypoint or a survey: multirotors fly nothing else");
  }
  const Waypoint& last() const {
    return plan.mission.waypoints.empty() ? plan.mission.start : plan.mission.waypoints.back().at;
  }

  const RunFile& run_;
  const VehicleSetup& setup_;
  const render::Surface& ground_;
  std::span<const VehicleCamera> cameras_;
  double yaw_rad_ = 0;  // of the nose, as far as items say
};

Result<void> MultirotorPlanner::begin() {
  const MultirotorSetup& wanted = *setup_.multirotor;
  MultirotorMission& mission = plan.mission;
  const auto start = place_in_scene(setup_.start.place, setup_.start.height, ground_);
  if (!start) return fail(start);
  mission.start = {start->north_east_m.x(), start->north_east_m.y(), start->height_m};
  mission.ground_height_m = ground_.up_m();
  const double above_m = start->height_m - ground_.up_m();
  if (above_m < -on_ground_m)
    return fail(Error::Kind::Malformed,
                fmt::format("start: expected a height on the ground or above it, found {:.1f} m under it", -above_m));
  mission.from_ground = above_m <= on_ground_m;
  if (mission.from_ground)
    mission.start.height_m = ground_.up_m() + standing_height_m(gear_of(setup_.multirotor_vehicle()));
  mission.yaw_rad = yaw_rad_ = to_radians(setup_.yaw_deg);
  mission.take_off_height_m = wanted.take_off_height_m;
  mission.repeat = setup_.repeat_mission;
  mission.face_along = wanted.face_along;
  mission.land = wanted.land;
  mission.landing_mps = wanted.landing_mps;
  mission.limits = {.speed_mps = wanted.speed_mps,
                    .climb_mps = wanted.climb_mps,
                    .descent_mps = wanted.descent_mps,
                    .acceleration_mps2 = wanted.acceleration_mps2};
  return {};
}

Result<void> MultirotorPlanner::add(std::size_t item, const WaypointSetup& w) {
  const auto place = place_in_scene(w.place, w.height, ground_);
  if (!place) return fail(place);
  if (place->height_m <= ground_.up_m())
    return fail(Error::Kind::Malformed, fmt::format("expected a height above the ground, found {:.1f} m over it",
                                                    place->height_m - ground_.up_m()));
  PositionWaypoint point{.at = {place->north_east_m.x(), place->north_east_m.y(), place->height_m},
                         .hold_s = w.hold_s,
                         .speed_mps = w.speed_mps,
                         .yaw_rad = {}};
  if (w.yaw_deg) point.yaw_rad = yaw_rad_ = to_radians(*w.yaw_deg);
  plan.mission.waypoints.push_back(point);
  plan.setup_item.push_back(item);
  return {};
}

/// Stops at the ends of lines, the nose along the first of them all the while: none is begun while it turns.
Result<void> MultirotorPlanner::add(std::size_t item, const SurveySetup& s) {
  const double speed_mps = s.speed_mps.value_or(setup_.multirotor->speed_mps);
  const SurveyFlight flight{
      .along =
          [&](double course, bool back, const Vector2d& wind, const auto& at) {
            const double nose = back ? std::numbers::pi : 0;
            const Vector2d air = speed_mps * Vector2d(std::cos(course), std::sin(course)) - wind;
            LineFlight line{{nose, 0, 0}, speed_mps};
            if (const auto steady = multirotor_steady(run_, setup_, course + nose, {air.x(), air.y(), 0}, ground_, at))
              line.course_from_body = {nose, steady->pitch_rad, steady->roll_rad};  // else preflight tells of none
            return line;
          },
      .from = {last().north_m, last().east_m}};
  auto planned = plan_survey_in_scene(run_, s, ground_, cameras_, flight);
  if (!planned) return fail(planned);
  auto& [lines, survey] = *planned;
  survey.item = item;
  plan.surveys.push_back(survey);
  const double turn_rad = std::abs(std::remainder(lines.heading_rad - yaw_rad_, 2 * std::numbers::pi));
  for (const Waypoint& w : lines.waypoints) {
    const bool first = &w == lines.waypoints.data();
    PositionWaypoint point{.at = w, .hold_s = 0, .speed_mps = s.speed_mps, .yaw_rad = lines.heading_rad};
    if (first) point.hold_s = turn_rad / (0.8 * MultirotorGains().max_yaw_rate_radps);  // as fast as the pilot turns it
    if (((w.north_m - last().north_m) * (w.north_m - last().north_m) +
         (w.east_m - last().east_m) * (w.east_m - last().east_m) +
         (w.height_m - last().height_m) * (w.height_m - last().height_m)) < 1e-4)
      continue;  // it is there already
    plan.mission.waypoints.push_back(point);
    plan.setup_item.push_back(item);
  }
  yaw_rad_ = lines.heading_rad;
  return {};
}

}  // namespace

Result<MultirotorPlan> plan_multirotor_mission(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                                               const render::Surface& ground, std::span<const VehicleCamera> cameras) {
  std::string message;
  const auto note = [&](const std::string& line) { message += (message.empty() ? "" : "\n") + line; };
  const auto note_vehicle = [&](const std::string& text) {
    note(fmt::format("{}: 'vehicles.{}': {}", run.file.string(), name, text));
  };
  MultirotorPlanner planner(run, setup, ground, cameras);
  if (auto ok = planner.begin(); !ok) note_vehicle(ok.error().message);
  for (std::size_t i = 0; i < setup.mission.size(); ++i) {
    const auto ok = std::visit([&](const auto& what) { return planner.add(i, what); }, setup.mission[i].what);
    if (!ok) note(mission_message(run, setup.mission[i], ok.error().message));
  }
  if (message.empty())
    if (auto pilot = MultirotorPilot::create(planner.plan.mission, 1); !pilot) note_vehicle(pilot.error().message);
  if (!message.empty()) return fail(Error::Kind::Malformed, message);
  return std::move(planner.plan);
}

std::vector<PlannedPoint> planned_path(const MultirotorPlan& plan, double until_s) {
  constexpr double step_s = 0.5;
  return planned_points(plan.mission, step_s, until_s).value();  // it was planned, so that it has a pilot
}

}  // namespace nadir::sim

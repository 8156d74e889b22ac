#include "nadir/sim/flight_plan.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "climb_out.h"
#include "flight_air.h"
#include "nadir/sim/plan_check.h"
#include "nadir/sim/random_path.h"
#include "scene_place.h"
#include "survey_plan.h"
#include "vehicle_kind.h"

namespace nadir::sim {
namespace {

using Eigen::Vector2d;
using geodesy::to_radians;

std::optional<double> radians(std::optional<double> degrees) {
  return degrees ? std::optional(to_radians(*degrees)) : std::nullopt;
}

/// Makes the items of one mission, one after the other.
class Planner {
 public:
  Planner(const RunFile& run, const std::string& name, const VehicleSetup& setup, const render::Surface& ground,
          std::span<const VehicleCamera> cameras)
      : run_(run), name_(name), setup_(setup), ground_(ground), cameras_(cameras) {}

  Result<FlightPlan> plan();

 private:
  Result<ScenePlace> place(const PlaceSetup& setup, const geodesy::TypedHeight& height) const {
    return place_in_scene(setup, height, ground_);
  }
  Result<void> add(const WaypointSetup& setup);
  Result<void> add(const OrbitSetup& setup);
  Result<void> add(const SurveySetup& setup);
  Result<void> add(const RandomPathSetup& setup);
  /// The last waypoint, or the start; without course where it is left in another one than known here.
  Waypoint last() const;
  double duration_s() const { return seconds_from_ns(run_.duration_ns); }

  const RunFile& run_;
  const std::string& name_;
  const VehicleSetup& setup_;
  const render::Surface& ground_;
  std::span<const VehicleCamera> cameras_;

  Waypoint start_;
  std::size_t item_ = 0;  // of the setup
  std::vector<MissionItem> items_;
  std::vector<std::size_t> setup_item_;
  std::vector<PlannedSurvey> surveys_;
};

Waypoint Planner::last() const {
  if (items_.empty()) return start_;
  if (const auto* waypoint = std::get_if<Waypoint>(&items_.back())) return *waypoint;
  const auto& orbit = std::get<Orbit>(items_.back());
  return {orbit.north_m, orbit.east_m, orbit.height_m};
}

Result<void> Planner::add(const WaypointSetup& w) {
  const auto p = place(w.place, w.height);
  if (!p) return fail(p);
  items_.emplace_back(Waypoint{p->north_east_m.x(), p->north_east_m.y(), p->height_m, radians(w.course_deg),
                               w.turn_radius_m, w.airspeed_mps});
  return {};
}

Result<void> Planner::add(const OrbitSetup& o) {
  const auto p = place(o.center, o.height);
  if (!p) return fail(p);
  items_.emplace_back(Orbit{p->north_east_m.x(), p->north_east_m.y(), p->height_m, o.radius_m, o.clockwise, o.turns,
                            o.duration_s, o.airspeed_mps});
  return {};
}

Result<void> Planner::add(const SurveySetup& s) {
  const double airspeed = s.airspeed_mps.value_or(setup_.airspeed_mps);
  const SurveyFlight flight{
      .along =
          [&](double course, bool, const Vector2d& wind, const auto& at) {
            // Against the wind the nose crabs, and of what is seen less lies along the lines
            const double across = wind.dot(Vector2d(-std::sin(course), std::cos(course)));
            const double crab = -std::asin(std::clamp(across / airspeed, -1.0, 1.0));
            const double pitch = level_pitch_rad(run_, setup_, airspeed, at).value_or(0);  // preflight tells of none
            return LineFlight{{crab, pitch, 0}, ground_speed_mps(airspeed, course, wind)};
          },
      .turn_radius_m = setup_.turn_radius_m,
      .from = {last().north_m, last().east_m}};
  auto plan = plan_survey_in_scene(run_, s, ground_, cameras_, flight);
  if (!plan) return fail(plan);
  plan->second.item = item_;
  surveys_.push_back(plan->second);
  for (Waypoint w : plan->first.waypoints) {
    w.airspeed_mps = s.airspeed_mps;
    items_.emplace_back(w);
  }
  return {};
}

Result<void> Planner::add(const RandomPathSetup& r) {
  const auto within = area_in_scene(r.area, r.heights.first, ground_);
  if (!within) return fail(within);
  const Vector2d middle = within->bounds().center();
  const PlaceSetup at{.north_m = middle.x(), .east_m = middle.y(), .geodetic = {}};
  const auto low = place(at, r.heights.first), high = place(at, r.heights.second);
  if (!low) return fail(low);
  if (!high) return fail(high);
  if (low->height_m > high->height_m)
    return fail(Error::Kind::Malformed,
                fmt::format("expected rising heights, found {:.1f} m over {:.1f} m", low->height_m, high->height_m));
  const double fastest_mps = r.airspeed_mps ? r.airspeed_mps->second : setup_.airspeed_mps;
  const Waypoint from = last();
  const RandomPathOrder order{.height_m = {low->height_m, high->height_m},
                              .turn_radius_m = r.turn_radius_m,
                              .max_slope = r.max_slope,
                              .airspeed_mps = r.airspeed_mps,
                              .margin_m = r.margin_m,
                              .length_m = r.length_m.value_or(duration_s() * (fastest_mps + run_.air.wind_speed_mps)),
                              .start_known = items_.empty() || from.course_rad};
  const auto path = random_path(*within, order, from, RandomStream(run_.seed, fmt::format("path/{}/{}", name_, item_)));
  if (!path) return fail(path);
  for (const Waypoint& w : *path) items_.emplace_back(w);
  return {};
}

Result<FlightPlan> Planner::plan() {
  std::string message;
  const auto note = [&](const std::string& line) { message += (message.empty() ? "" : "\n") + line; };
  const auto note_vehicle = [&](const std::string& text) {
    note(fmt::format("{}: 'vehicles.{}': {}", run_.file.string(), name_, text));
  };
  const auto start = place(setup_.start.place, setup_.start.height);
  if (!start) return fail(start);
  start_ = {start->north_east_m.x(), start->north_east_m.y(), start->height_m, to_radians(setup_.yaw_deg)};
  const Waypoint begin = start_;
  constexpr double on_ground_m = 1e-3;
  const double above_m = height_above_ground_m(ground_, ecef_from_scene(*start, ground_));
  if (above_m < -on_ground_m)
    note_vehicle(fmt::format("start: expected a height on the ground or above it, found {:.1f} m over it", above_m));
  auto on_ground = ground_flight(setup_.ground, setup_.fixed_wing(), ground_, begin, to_radians(setup_.yaw_deg),
                                 above_m < on_ground_m);
  if (!on_ground) note_vehicle(on_ground.error().message);
  if (on_ground && on_ground->takeoff) {
    const auto end = climb_out(run_, name_, setup_, begin, *on_ground, ground_);
    if (end)
      start_ = *end;
    else
      note_vehicle(end.error().message);
  }

  for (item_ = 0; item_ < setup_.mission.size(); ++item_) {
    const auto ok = std::visit([&](const auto& what) { return add(what); }, setup_.mission[item_].what);
    if (!ok) note(mission_message(run_, setup_.mission[item_], ok.error().message));
    setup_item_.resize(items_.size(), item_);
  }
  if (on_ground && on_ground->landing) {
    for (const Waypoint& gate : approach(*on_ground->landing, setup_.ground.land->straight_m))
      items_.emplace_back(gate);
    if (!setup_.mission.empty()) setup_item_.resize(items_.size(), setup_.mission.size() - 1);
  }
  if (items_.empty() && message.empty()) {
    const double reach_m = (setup_.airspeed_mps + 100) * (duration_s() + 10);
    items_.emplace_back(Waypoint{start_.north_m + reach_m * std::cos(*start_.course_rad),
                                 start_.east_m + reach_m * std::sin(*start_.course_rad), start_.height_m});
  }
  const AfterMission after = on_ground && on_ground->landing ? AfterMission::GoesOn
                             : setup_.repeat_mission         ? AfterMission::Repeat
                                                             : AfterMission::Circle;
  for (const MissionFault& f : Mission::faults(start_, items_, setup_.turn_radius_m, after)) {
    if (!message.empty() && !f.item) continue;  // it comes of what was told already
    if (f.item && !setup_item_.empty())
      note(mission_message(run_, setup_.mission[setup_item_[*f.item]], f.message));
    else
      note_vehicle(f.message);
  }
  if (!message.empty()) return fail(Error::Kind::Malformed, message);
  auto mission = Mission::create(start_, items_, setup_.turn_radius_m, after);
  if (!mission) return fail(mission);
  return FlightPlan{
      {std::move(setup_item_), std::move(surveys_)}, begin, std::move(*on_ground), start_, std::move(*mission)};
}

}  // namespace

std::string mission_message(const RunFile& run, const MissionItemSetup& item, const std::string& message) {
  return fmt::format("{}:{}: '{}': {}", run.file.string(), item.line, item.name, message);
}

Result<FlightPlan> plan_mission(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                                const render::Surface& ground, std::span<const VehicleCamera> cameras) {
  return Planner(run, name, setup, ground, cameras).plan();
}

}  // namespace nadir::sim

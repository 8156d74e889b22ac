#include "nadir/sim/flight_plan.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "climb_out.h"
#include "flight_air.h"
#include "nadir/sim/plan_check.h"
#include "nadir/sim/random_path.h"
#include "nadir/sim/survey.h"
#include "scene_place.h"
#include "vehicle_kind.h"

namespace nadir::sim {
namespace {

using Eigen::Vector2d;
using geodesy::to_radians;

constexpr double swing_share = 0.02;  // of the height: a degree of attitude, and a metre off the path
constexpr double rate_margin = 1.01;  // for speeds over ground a little above the planned one

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
  Result<Area> area(const AreaSetup& setup, const geodesy::TypedHeight& height) const;
  Result<void> add(const WaypointSetup& setup);
  Result<void> add(const OrbitSetup& setup);
  Result<void> add(const SurveySetup& setup);
  Result<void> add(const RandomPathSetup& setup);
  void add_waypoints(const std::vector<Waypoint>& waypoints) {
    for (const Waypoint& w : waypoints) items_.emplace_back(w);
  }
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

Result<Area> Planner::area(const AreaSetup& setup, const geodesy::TypedHeight& height) const {
  const auto at = [&](const PlaceSetup& p) { return place(p, height); };
  if (const auto* rectangle = std::get_if<RectangleSetup>(&setup)) {
    const auto center = at(rectangle->center);
    if (!center) return fail(center);
    return Area::rectangle(center->north_east_m, rectangle->length_m, rectangle->width_m,
                           to_radians(rectangle->heading_deg));
  }
  if (const auto* disc = std::get_if<DiscSetup>(&setup)) {
    const auto center = at(disc->center);
    if (!center) return fail(center);
    return Area::disc(center->north_east_m, disc->radius_m);
  }
  std::vector<Vector2d> corners;
  for (const PlaceSetup& corner : std::get<std::vector<PlaceSetup>>(setup)) {
    const auto p = at(corner);
    if (!p) return fail(p);
    corners.push_back(p->north_east_m);
  }
  return Area::polygon(std::move(corners));
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
  const auto over = area(s.area, s.height);
  if (!over) return fail(over);
  const VehicleCamera* camera = nullptr;
  for (const VehicleCamera& c : cameras_)
    if (c.name == s.sensor) camera = &c;

  // Height and wind are those over the middle of the area
  const Vector2d middle = over->bounds().center();
  const auto center = place({.north_m = middle.x(), .east_m = middle.y(), .geodetic = {}}, s.height);
  if (!center) return fail(center);
  const auto p = ecef_from_scene(*center, ground_);
  const double above_m = height_above_ground_m(ground_, p);
  if (!(above_m > 0)) return fail(Error::Kind::Malformed, fmt::format("lies {:.1f} m under the ground", -above_m));
  const auto winds = make_winds(run_);
  if (!winds) return fail(winds);
  const auto wind_ned = wind_at(*winds, p, ground_);
  if (!wind_ned) return fail(wind_ned);
  const Vector2d wind = wind_ned->head<2>();
  const double airspeed = s.airspeed_mps.value_or(setup_.airspeed_mps);

  SurveyOrder order;
  const double pitch = level_pitch_rad(run_, setup_, airspeed, p).value_or(0);  // preflight tells where there is none
  order.seen_m = seen_for_certain(*camera, above_m, 0, pitch);
  order.forward_overlap = s.forward_overlap;
  order.side_overlap = s.side_overlap;
  order.heading_rad = radians(s.heading_deg);
  order.height_m = center->height_m;
  order.lead_in_m = s.lead_in_m;
  order.lead_out_m = s.lead_out_m;
  order.turn_radius_m = setup_.turn_radius_m;
  order.airspeed_mps = s.airspeed_mps;
  order.from = Vector2d(last().north_m, last().east_m);
  auto plan = plan_survey(*over, order);
  if (!plan) return fail(plan);

  // Against the wind the nose crabs, and of what is seen less lies along the lines
  double fastest_mps = 0;
  for (const double course : {plan->heading_rad, plan->heading_rad + std::numbers::pi}) {
    const double across = wind.dot(Vector2d(-std::sin(course), std::cos(course)));
    const double crab = -std::asin(std::clamp(across / airspeed, -1.0, 1.0));
    order.seen_m = order.seen_m.intersection(seen_for_certain(*camera, above_m, crab, pitch));
    fastest_mps = std::max(fastest_mps, ground_speed_mps(airspeed, course, wind));
  }
  order.heading_rad = plan->heading_rad;
  plan = plan_survey(*over, order);
  if (!plan) return fail(plan);
  PlannedSurvey survey;
  survey.item = item_;
  survey.sensor = s.sensor;
  survey.lines = plan->lines;
  survey.seen_at_least = plan->seen_at_least;
  survey.heading_rad = plan->heading_rad;
  survey.line_spacing_m = plan->line_spacing_m;
  survey.exposure_spacing_m = plan->exposure_spacing_m;
  survey.rate_hz = rate_margin * fastest_mps / plan->exposure_spacing_m;
  surveys_.push_back(survey);
  add_waypoints(plan->waypoints);
  return {};
}

Result<void> Planner::add(const RandomPathSetup& r) {
  const auto within = area(r.area, r.heights.first);
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
  add_waypoints(*path);
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
  auto on_ground = ground_flight(setup_.ground, gear_of(setup_.model), ground_, begin, to_radians(setup_.yaw_deg),
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

Eigen::AlignedBox2d seen_for_certain(const VehicleCamera& camera, double height_m, double crab_rad, double pitch_rad) {
  // Where the border of the image lies on the ground, forward and right of the vehicle along its course
  constexpr int steps = 64;
  const double width = camera.camera->width_px(), height = camera.camera->height_px();
  const Eigen::Quaterniond course_from_body(Eigen::AngleAxisd(crab_rad, Eigen::Vector3d::UnitZ()) *
                                            Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()));
  std::vector<Vector2d> border;
  Vector2d middle = Vector2d::Zero();
  for (int i = 0; i < steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    for (const Vector2d& image : {Vector2d(s * width, 0), Vector2d(width, s * height),
                                  Vector2d((1 - s) * width, height), Vector2d(0, (1 - s) * height)}) {
      const auto ray = camera.camera->ray_of(image);
      if (!ray) return {};
      const Eigen::Vector3d down = course_from_body * (camera.body_from_camera.rotation * *ray);
      if (down.z() < 0.02 * down.norm()) return {};  // within a degree of the horizon
      const Eigen::Vector3d mount = course_from_body * camera.body_from_camera.origin;
      border.emplace_back((mount + (height_m - mount.z()) / down.z() * down).head<2>());
      if (i == 0) middle += border.back() / 4;
    }
  }

  // Of boxes around the middle, `ratio` as wide as long, the longest without a point of the border in it
  const auto half_length = [&](double ratio) {
    double least = INFINITY;
    for (const Vector2d& p : border)
      least = std::min(least, std::max(std::abs(p.x() - middle.x()), std::abs(p.y() - middle.y()) / ratio));
    return least;
  };
  const auto area = [&](double log_ratio) {
    const double ratio = std::exp(log_ratio), half = half_length(ratio);
    return ratio * half * half;
  };
  double best = 0;
  for (double log_ratio = -3; log_ratio <= 3; log_ratio += 0.1)
    if (area(log_ratio) > area(best)) best = log_ratio;
  double low = best - 0.1, high = best + 0.1;
  for (int i = 0; i < 80; ++i) {  // by thirds: below and above the best one the area falls
    const double third = (high - low) / 3;
    if (area(low + third) < area(high - third))
      low += third;
    else
      high -= third;
  }
  const double ratio = std::exp((low + high) / 2), half = half_length(ratio);
  const Vector2d sides = Vector2d(half, ratio * half).array() - swing_share * height_m;
  if (!(sides.minCoeff() > 0)) return {};
  return {middle - sides, middle + sides};
}

Result<FlightPlan> plan_mission(const RunFile& run, const std::string& name, const VehicleSetup& setup,
                                const render::Surface& ground, std::span<const VehicleCamera> cameras) {
  return Planner(run, name, setup, ground, cameras).plan();
}

}  // namespace nadir::sim

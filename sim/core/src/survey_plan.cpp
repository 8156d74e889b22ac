#include "survey_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flight_air.h"
#include "scene_place.h"

namespace nadir::sim {
namespace {

using Eigen::Vector2d;
using geodesy::to_radians;

constexpr double swing_share = 0.02;  // of the height: a degree of attitude, and a metre off the path
constexpr double rate_margin = 1.01;  // for speeds over ground a little above the planned one

}  // namespace

Result<Area> area_in_scene(const AreaSetup& setup, const geodesy::TypedHeight& height, const render::Surface& ground) {
  const auto at = [&](const PlaceSetup& p) { return place_in_scene(p, height, ground); };
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

Result<std::pair<SurveyPlan, PlannedSurvey>> plan_survey_in_scene(const RunFile& run, const SurveySetup& s,
                                                                  const render::Surface& ground,
                                                                  std::span<const VehicleCamera> cameras,
                                                                  const SurveyFlight& flight) {
  const auto over = area_in_scene(s.area, s.height, ground);
  if (!over) return fail(over);
  const VehicleCamera* camera = nullptr;
  for (const VehicleCamera& c : cameras)
    if (c.name == s.sensor) camera = &c;

  // Height and wind are those over the middle of the area
  const Vector2d middle = over->bounds().center();
  const auto center = place_in_scene({.north_m = middle.x(), .east_m = middle.y(), .geodetic = {}}, s.height, ground);
  if (!center) return fail(center);
  const auto p = ecef_from_scene(*center, ground);
  const double above_m = height_above_ground_m(ground, p);
  if (!(above_m > 0)) return fail(Error::Kind::Malformed, fmt::format("lies {:.1f} m under the ground", -above_m));
  const auto winds = make_winds(run);
  if (!winds) return fail(winds);
  const auto wind_ned = wind_at(*winds, p, ground);
  if (!wind_ned) return fail(wind_ned);
  const Vector2d wind = wind_ned->head<2>();

  SurveyOrder order;
  order.seen_m = seen_for_certain(*camera, above_m, flight.along(0, false, Vector2d::Zero(), p).course_from_body);
  order.forward_overlap = s.forward_overlap;
  order.side_overlap = s.side_overlap;
  if (s.heading_deg) order.heading_rad = to_radians(*s.heading_deg);
  order.height_m = center->height_m;
  order.lead_in_m = s.lead_in_m;
  order.lead_out_m = s.lead_out_m;
  order.turn_radius_m = flight.turn_radius_m;
  order.from = flight.from;
  auto plan = plan_survey(*over, order);
  if (!plan) return fail(plan);

  // To and fro in that wind
  double fastest_mps = 0;
  for (const bool back : {false, true}) {
    const LineFlight line = flight.along(plan->heading_rad + (back ? std::numbers::pi : 0), back, wind, p);
    order.seen_m = order.seen_m.intersection(seen_for_certain(*camera, above_m, line.course_from_body));
    fastest_mps = std::max(fastest_mps, line.ground_speed_mps);
  }
  order.heading_rad = plan->heading_rad;
  plan = plan_survey(*over, order);
  if (!plan) return fail(plan);
  PlannedSurvey survey;
  survey.sensor = s.sensor;
  survey.lines = plan->lines;
  survey.seen_at_least = plan->seen_at_least;
  survey.heading_rad = plan->heading_rad;
  survey.line_spacing_m = plan->line_spacing_m;
  survey.exposure_spacing_m = plan->exposure_spacing_m;
  survey.rate_hz = rate_margin * fastest_mps / plan->exposure_spacing_m;
  return std::pair(std::move(*plan), survey);
}

Eigen::AlignedBox2d seen_for_certain(const VehicleCamera& camera, double height_m,
                                     const geodesy::YawPitchRoll& attitude) {
  // Where the border of the image lies on the ground, forward and right of the vehicle along its course
  constexpr int steps = 64;
  const double width = camera.camera->width_px(), height = camera.camera->height_px();
  const Eigen::Quaterniond course_from_body = geodesy::quaternion_from(attitude);
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

}  // namespace nadir::sim

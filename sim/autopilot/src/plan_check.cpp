#include "nadir/sim/plan_check.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>

namespace nadir::sim {
namespace {
using Eigen::Vector2d;
constexpr double gravity_mps2 = 9.81;
constexpr double to_deg = 57.29577951308232;
constexpr double doubtful_share = 0.875;

/// The worst place of one kind on the way to one item.
struct Worst {
  double measure = -INFINITY;  // larger is worse
  PlannedPoint point;
  double ground_speed_mps = 0, airspeed_mps = 0;
  Vector2d wind_mps = Vector2d::Zero();
};
enum Kind { Climb, Turn, Corner, Ground, Headway, Airspeed, kinds };

/// Bank that a turn takes: the nose crabs, and only the part of lift across the course bends the path.
double bank_rad(const Worst& at) {
  const Vector2d right(-std::sin(at.point.course_rad), std::cos(at.point.course_rad));
  const double crab = std::asin(std::min(1.0, std::abs(at.wind_mps.dot(right)) / at.airspeed_mps));
  return std::atan(at.ground_speed_mps * at.ground_speed_mps * std::abs(at.point.curve_per_m) /
                   (gravity_mps2 * std::max(0.5, std::cos(crab))));
}

std::string climb_message(const Worst& at, const FlightLimits& limits) {
  if (at.point.kept)
    return fmt::format("asks for a climb of {:.1f} m/s; the vehicle's limit is {:.1f} m/s: lower its climb_mps",
                       at.point.kept->climb_mps, limits.max_climb_mps);
  return fmt::format(
      "asks for a {} of {:.1f} m/s, a slope of {:.3f} at {:.1f} m/s over ground; the autopilot's limit is {:g} m/s: "
      "make the way longer or the change of height smaller",
      at.point.slope > 0 ? "climb" : "descent", at.measure * limits.max_climb_mps, std::abs(at.point.slope),
      at.ground_speed_mps, limits.max_climb_mps);
}
std::string turn_message(const Worst& at, const FlightLimits& limits) {
  const double radius = 1 / std::abs(at.point.curve_per_m), most = std::tan(doubtful_share * limits.max_bank_rad);
  return fmt::format(
      "a turn of {:.0f} m at {:.1f} m/s over ground takes {:.0f} degrees of bank; the autopilot's limit is {:.0f}: use "
      "a radius of {:.0f} m",
      radius, at.ground_speed_mps, bank_rad(at) * to_deg, limits.max_bank_rad * to_deg,
      std::ceil(radius * std::tan(bank_rad(at)) / most));
}
/// How far beyond a corner the tightest turn leads, until it runs along the way that follows.
double off_corner_m(const Worst& at, const FlightLimits& limits) {
  const double v = at.ground_speed_mps;
  return v * v / (gravity_mps2 * std::tan(limits.max_bank_rad)) * (1 - std::cos(at.point.corner->turn_rad));
}
std::string corner_message(const Worst& at) {
  const SharpCorner& corner = *at.point.corner;
  return fmt::format(
      "its corner of {:.0f} degrees has no room for an arc, and leads at least {:.0f} m off the path: {}",
      corner.turn_rad * to_deg, at.measure,
      corner.fitting_radius_m > 0 ? fmt::format("a turn_radius_m of {:.0f} would fit, or make the legs longer",
                                                std::floor(corner.fitting_radius_m))
                                  : "put a waypoint between");
}
std::string ground_message(const Worst& at) {
  const double above_m = -at.measure;
  return fmt::format("{} at north {:.0f} m, east {:.0f} m: raise it",
                     above_m > 0 ? fmt::format("comes within {:.1f} m of the ground", above_m)
                                 : fmt::format("leads {:.1f} m under the ground", -above_m),
                     std::round(at.point.north_m) + 0.0, std::round(at.point.east_m) + 0.0);
}
std::string headway_message(const Worst& at) {
  return fmt::format(
      "a wind of {:.1f} m/s and an airspeed of {:.1f} m/s leave {} along the course of {:.0f} degrees: {}",
      at.wind_mps.norm(), at.airspeed_mps,
      at.ground_speed_mps > 0 ? fmt::format("{:.1f} m/s over ground", at.ground_speed_mps) : std::string("no headway"),
      std::fmod(at.point.course_rad * to_deg + 720, 360), "fly faster, or in less wind");
}

std::string airspeed_message(const Worst& at, const FlightLimits& limits) {
  return fmt::format(
      "{:.1f} m/s over ground along the course of {:.0f} degrees take an airspeed of {:.1f} m/s in a wind of {:.1f} "
      "m/s; the vehicle's limit is {:.1f}: fly more slowly, or in less wind",
      at.ground_speed_mps, std::fmod(at.point.course_rad * to_deg + 720, 360), at.airspeed_mps, at.wind_mps.norm(),
      limits.max_airspeed_mps);
}

}  // namespace

double ground_speed_mps(double airspeed_mps, double course_rad, const Vector2d& wind_mps) {
  const Vector2d along(std::cos(course_rad), std::sin(course_rad)), right(-along.y(), along.x());
  const double across = wind_mps.dot(right), left = airspeed_mps * airspeed_mps - across * across;
  return left > 0 ? wind_mps.dot(along) + std::sqrt(left) : -INFINITY;
}

Result<PlanCheck> check_plan(std::span<const PlannedPoint> points, const FlightLimits& limits,
                             const std::function<Result<PlanSurroundings>(const PlannedPoint&)>& surroundings) {
  std::map<std::size_t, std::array<Worst, kinds>> items;
  PlanCheck check;
  for (const PlannedPoint& point : points) {
    const auto here = surroundings(point);
    if (!here) return fail(here);
    auto& worst = items[point.item];
    Worst at{0, point, 0, point.airspeed_mps.value_or(limits.airspeed_mps), here->wind_mps};
    const auto offer = [&](Kind kind, double measure) {
      at.measure = measure;
      if (measure > worst[kind].measure) worst[kind] = at;
    };
    if (!point.low) offer(Ground, -here->above_ground_m);
    if (const auto& kept = point.kept) {
      check.seconds += kept->seconds;
      at.ground_speed_mps = kept->ground_speed_mps;
      const Vector2d along(std::cos(point.course_rad), std::sin(point.course_rad));
      at.airspeed_mps = (kept->ground_speed_mps * along - at.wind_mps).norm();
      offer(Airspeed, at.airspeed_mps / limits.max_airspeed_mps);
      offer(Climb, kept->climb_mps / limits.max_climb_mps);
      continue;
    }
    at.ground_speed_mps = ground_speed_mps(at.airspeed_mps, point.course_rad, at.wind_mps);
    const bool moves = at.ground_speed_mps > 0;
    check.seconds += moves ? point.length_m / at.ground_speed_mps : INFINITY;

    offer(Headway, -at.ground_speed_mps / at.airspeed_mps);
    if (!moves) continue;
    offer(Climb, std::abs(point.slope) * at.ground_speed_mps / limits.max_climb_mps);
    offer(Turn, bank_rad(at) / limits.max_bank_rad);
    if (point.corner) offer(Corner, off_corner_m(at, limits));
  }

  constexpr double near_path_m = 10;
  constexpr double slack = 1e-9;  // what is laid out at a limit keeps it
  for (const auto& [item, worst] : items) {
    const auto note = [&, item = item](Kind kind, double doubtful, double impossible, const auto& message) {
      const Worst& at = worst[kind];
      if (at.measure > doubtful) check.findings.push_back({item, at.measure > impossible, message(at)});
    };
    note(Climb, doubtful_share, 1 + slack, [&](const Worst& at) { return climb_message(at, limits); });
    note(Turn, doubtful_share, 1 + slack, [&](const Worst& at) { return turn_message(at, limits); });
    note(Corner, near_path_m, INFINITY, corner_message);
    note(Ground, -limits.near_ground_m, 0, ground_message);
    note(Headway, -(1 - doubtful_share), 0, headway_message);
    note(Airspeed, doubtful_share, 1 + slack, [&](const Worst& at) { return airspeed_message(at, limits); });
  }
  return check;
}

}  // namespace nadir::sim

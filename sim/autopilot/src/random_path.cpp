#include "nadir/sim/random_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "nadir/sim/dubins.h"

namespace nadir::sim {
namespace {
using Eigen::Vector2d;
constexpr double pi = std::numbers::pi;
constexpr std::uint64_t most_draws = 5000;
constexpr std::size_t most_waypoints = 1'000'000;

/// Six uniform numbers in [0, 1) of one candidate.
std::array<double, 6> uniforms(const RandomStream& stream, std::uint64_t waypoint, std::uint64_t draw) {
  const auto a = stream.bits(waypoint, 2 * draw), b = stream.bits(waypoint, 2 * draw + 1);
  std::array<double, 6> out;
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = 0x1p-32 * (i < 4 ? a[i] : b[i - 4]);
  return out;
}

double between(const std::pair<double, double>& range, double share) {
  return range.first + share * (range.second - range.first);
}

/// Whether all of a way lies in the area. Looked at in steps of a sixteenth of the turn's radius: no point is farther
/// from one looked at than half a step, which the margin takes in.
bool stays_within(const Area& area, const Way& way, double radius_m, double margin_m) {
  const double step_m = radius_m / 16;
  for (const Path& path : way.pieces) {
    const double length = length_m(path);
    const auto steps = static_cast<int>(std::ceil(length / step_m));
    for (int i = 0; i <= steps; ++i) {
      const double share = static_cast<double>(i) / steps;
      Vector2d p;
      if (const auto* line = std::get_if<StraightPath>(&path)) {
        p = line->from + share * (line->to - line->from);
      } else {
        const auto& arc = std::get<CirclePath>(path);
        const double at = arc.from_rad + (arc.clockwise ? 1 : -1) * share * arc.sweep_rad;
        p = arc.center + arc.radius_m * Vector2d(std::cos(at), std::sin(at));
      }
      if (!area.contains(p, margin_m + step_m / 2)) return false;
    }
  }
  return true;
}

}  // namespace

Result<std::vector<Waypoint>> random_path(const Area& area, const RandomPathOrder& order, const Waypoint& start,
                                          const RandomStream& stream) {
  const Eigen::AlignedBox2d box = area.bounds();
  std::vector<Waypoint> path;
  Waypoint last = start;
  bool within = order.start_known &&
                area.contains({start.north_m, start.east_m}, order.margin_m + order.turn_radius_m.first / 32);
  for (double length_m = 0; length_m < order.length_m || path.empty();) {
    const std::uint64_t index = path.size();
    std::optional<Waypoint> next;
    for (std::uint64_t draw = 0; draw < most_draws && !next; ++draw) {
      const auto u = uniforms(stream, index, draw);
      const Vector2d place = box.min() + Vector2d(u[0], u[1]).cwiseProduct(box.sizes());
      const double course = (2 * u[2] - 1) * pi, radius = between(order.turn_radius_m, u[3]);
      const double circle_m = order.turn_radius_m.second;
      const Vector2d center = place + circle_m * Vector2d(-std::sin(course), std::cos(course));
      if (!area.contains(center, order.margin_m + circle_m)) continue;
      const auto way = shortest_way(WayEnd::pose({last.north_m, last.east_m}, last.course_rad.value_or(0)),
                                    WayEnd::pose(place, course), radius);
      if (way->length_m < 2 * radius || (within && !stays_within(area, *way, radius, order.margin_m))) continue;
      const double reach_m = order.max_slope * way->length_m;
      const double wanted = between(order.height_m, u[4]),
                   height = std::clamp(wanted, last.height_m - reach_m, last.height_m + reach_m);
      next = Waypoint{place.x(), place.y(), height, course, radius, {}};
      if (order.airspeed_mps) next->airspeed_mps = between(*order.airspeed_mps, u[5]);
      length_m += way->length_m;
    }
    if (!next || index >= most_waypoints)
      return fail(Error::Kind::Malformed,
                  fmt::format("found no way within the area from waypoint {} on in {} tries: turns of {:g} m need more "
                              "room, or a smaller radius or margin",
                              index, most_draws, order.turn_radius_m.first));
    path.push_back(*next);
    last = *next;
    within = true;
  }
  return path;
}

}  // namespace nadir::sim

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
constexpr std::uint64_t most_draws = 5000;  // in a row, from one waypoint on
constexpr std::size_t most_dead_ends = 60;  // without getting any farther
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

/// A waypoint found, and what to go on with if no way leads on from it.
struct Found {
  Waypoint waypoint;
  double path_m = 0;  // up to it
  std::uint64_t next_draw = 0;
};

/// Goes from waypoint to waypoint, and back out of dead ends.
class Search {
 public:
  Search(const Area& area, const RandomPathOrder& order, const Waypoint& start, const RandomStream& stream)
      : area_(area), order_(order), start_(start), stream_(stream), box_(area.bounds()) {}

  bool starts_within() const {
    return order_.start_known &&
           area_.contains({start_.north_m, start_.east_m}, order_.margin_m + order_.turn_radius_m.first / 32);
  }

  /// Whether there is such a path, which is then in `path`.
  bool run() {
    std::size_t dead_ends = 0, farthest = 0;
    std::uint64_t draw = 0;  // to begin with
    while (path.empty() || path.back().path_m < order_.length_m) {
      if (path.size() >= most_waypoints) return false;
      if (const auto next = next_from(draw)) {
        path.push_back(*next);
        draw = 0;
        if (path.size() > farthest) farthest = path.size(), dead_ends = 0;
        continue;
      }
      // Farther back the longer it leads nowhere
      if (path.empty() || ++dead_ends > most_dead_ends) return false;
      for (std::size_t back = 1 + dead_ends / 8; back > 0 && !path.empty(); --back) {
        draw = path.back().next_draw;
        path.pop_back();
      }
    }
    return true;
  }

  std::vector<Found> path;

 private:
  std::optional<Found> next_from(std::uint64_t first_draw) const {
    const Waypoint& last = path.empty() ? start_ : path.back().waypoint;
    const bool within = !path.empty() || starts_within();
    for (std::uint64_t draw = first_draw; draw < first_draw + most_draws; ++draw) {
      const auto u = uniforms(stream_, path.size(), draw);
      const Vector2d place = box_.min() + Vector2d(u[0], u[1]).cwiseProduct(box_.sizes());
      const double course = (2 * u[2] - 1) * pi, radius = between(order_.turn_radius_m, u[3]);
      const double circle_m = order_.turn_radius_m.second;
      const Vector2d center = place + circle_m * Vector2d(-std::sin(course), std::cos(course));
      if (!area_.contains(center, order_.margin_m + circle_m)) continue;
      const auto way = shortest_way(WayEnd::pose({last.north_m, last.east_m}, last.course_rad.value_or(0)),
                                    WayEnd::pose(place, course), radius);
      if (way->length_m < 2 * radius || (within && !stays_within(area_, *way, radius, order_.margin_m))) continue;
      const double reach_m = order_.max_slope * way->length_m;
      const double wanted = between(order_.height_m, u[4]),
                   height = std::clamp(wanted, last.height_m - reach_m, last.height_m + reach_m);
      Found next{{place.x(), place.y(), height, course, radius, {}},
                 (path.empty() ? 0 : path.back().path_m) + way->length_m,
                 draw + 1};
      if (order_.airspeed_mps) next.waypoint.airspeed_mps = between(*order_.airspeed_mps, u[5]);
      return next;
    }
    return std::nullopt;
  }

  const Area& area_;
  const RandomPathOrder& order_;
  const Waypoint& start_;
  const RandomStream& stream_;
  const Eigen::AlignedBox2d box_;
};

}  // namespace

Result<std::vector<Waypoint>> random_path(const Area& area, const RandomPathOrder& order, const Waypoint& start,
                                          const RandomStream& stream) {
  const double needed_m = order.turn_radius_m.second + order.margin_m, widest_m = area.widest_m();
  if (needed_m > widest_m * 1.001)
    return fail(
        Error::Kind::Malformed,
        fmt::format("turns of {:g} m and a margin of {:g} m need a place {:.0f} m wide, and the area is {:.0f} m "
                    "wide at its widest: take a radius of at most {:.0f} m, or a larger area",
                    order.turn_radius_m.second, order.margin_m, 2 * needed_m, 2 * widest_m,
                    std::floor(std::max(0.0, widest_m - order.margin_m))));
  Search search(area, order, start, stream);
  if (!search.run())
    return fail(
        Error::Kind::Malformed,
        fmt::format("found no way within the area from {} on, in {} draws each and after going back: turns of "
                    "{:g} to {:g} m and a margin of {:g} m take {:.0f} m of the {:.0f} m that it is wide at its "
                    "widest: a smaller radius or margin helps",
                    search.path.empty()
                        ? std::string(search.starts_within() ? "the start, which lies in it" : "the start")
                        : fmt::format("waypoint {}", search.path.size()),
                    most_draws, order.turn_radius_m.first, order.turn_radius_m.second, order.margin_m, 2 * needed_m,
                    2 * widest_m));
  std::vector<Waypoint> path;
  for (const Found& found : search.path) path.push_back(found.waypoint);
  return path;
}

}  // namespace nadir::sim

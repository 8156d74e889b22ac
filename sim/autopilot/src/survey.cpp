#include "nadir/sim/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>

#include "nadir/sim/dubins.h"

namespace nadir::sim {
namespace {
using Eigen::Vector2d;
constexpr double pi = std::numbers::pi;
constexpr int most_lines = 10000;

/// How many of things `spacing` apart a stretch of length `seen` holds wherever it lies.
int at_least(double overlap) { return static_cast<int>(std::floor(1 / (1 - overlap) + 1e-9)); }

/// One strip of ground that a line sees, in axes along the lines (x) and to their right (y).
struct Strip {
  double y = 0;              // of its middle
  double low = 0, high = 0;  // of the area's x within it
};

struct Strips {
  std::vector<Strip> strips;
  double heading_rad = 0, spacing_m = 0, length_m = 0;
};

/// From x to y, the corners of a polygon cut to y >= limit (`sense` 1) or y <= limit (-1).
std::vector<Vector2d> cut(const std::vector<Vector2d>& corners, double limit, double sense) {
  std::vector<Vector2d> kept;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector2d &a = corners[i], &b = corners[(i + 1) % corners.size()];
    const double da = sense * (a.y() - limit), db = sense * (b.y() - limit);
    if (da >= 0) kept.push_back(a);
    if ((da < 0) != (db < 0)) kept.emplace_back(a + da / (da - db) * (b - a));
  }
  return kept;
}

/// Strips of one direction. The outermost ones reach so far beyond the area that its edges are seen by as many lines as
/// its middle; the spacing is evened out to the number of lines.
Strips strips_at(const Area& area, double heading_rad, double width_m, double side_overlap) {
  const Vector2d along(std::cos(heading_rad), std::sin(heading_rad)), right(-along.y(), along.x());
  std::vector<Vector2d> corners;
  for (const Vector2d& c : area.corners()) corners.emplace_back(c.dot(along), c.dot(right));
  const auto [lowest, highest] =
      std::minmax_element(corners.begin(), corners.end(), [](const auto& a, const auto& b) { return a.y() < b.y(); });
  const int often = at_least(side_overlap);
  const double spacing = width_m * (1 - side_overlap), beyond = (often - 1) * spacing;
  const double first = lowest->y() + width_m / 2 - beyond, last = highest->y() - width_m / 2 + beyond;

  Strips out;
  out.heading_rad = heading_rad;
  const double needed = std::max(std::ceil((last - first) / spacing - 1e-9) + 1, static_cast<double>(often));
  if (needed > most_lines) {
    out.length_m = INFINITY;
    return out;
  }
  const auto lines = static_cast<int>(needed);
  out.spacing_m = last > first && lines > 1 ? (last - first) / (lines - 1) : 0;
  const double middle = (first + last) / 2;
  for (int i = 0; i < lines; ++i) {
    Strip strip{middle + (i - 0.5 * (lines - 1)) * out.spacing_m};
    const auto seen = cut(cut(corners, strip.y - width_m / 2, 1), strip.y + width_m / 2, -1);
    if (seen.empty()) continue;
    const auto [low, high] =
        std::minmax_element(seen.begin(), seen.end(), [](const auto& a, const auto& b) { return a.x() < b.x(); });
    strip.low = low->x(), strip.high = high->x();
    out.length_m += strip.high - strip.low;
    out.strips.push_back(strip);
  }
  return out;
}

/// With the fewest lines, and of those the shortest; rounding does not choose.
Strips best_strips(const Area& area, double width_m, double side_overlap) {
  std::optional<Strips> best;
  const auto corners = area.corners();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector2d edge = corners[(i + 1) % corners.size()] - corners[i];
    double heading = std::fmod(std::atan2(edge.y(), edge.x()) + pi, pi);  // to and fro: [0, pi)
    if (heading > pi - 1e-9) heading = 0;
    Strips strips = strips_at(area, heading, width_m, side_overlap);
    const auto lines = [](const Strips& s) { return s.strips.empty() ? most_lines + 1 : s.strips.size(); };
    if (!best || lines(strips) < lines(*best) ||
        (lines(strips) == lines(*best) && strips.length_m < best->length_m * (1 - 1e-9)))
      best = std::move(strips);
  }
  return *best;
}

/// The order of `lines` in blocks of nearly one size: by turns a line of the lower half and one of the upper, with
/// neighbours in time half a block apart. A block begins in the half that lies away from where the last one ended.
std::vector<std::size_t> by_halves(std::size_t lines, std::size_t blocks) {
  std::vector<std::size_t> order;
  bool high_first = false;
  for (std::size_t block = 0; block < blocks; ++block) {
    const std::size_t begin = lines * block / blocks, size = lines * (block + 1) / blocks - begin;
    const std::size_t lower = high_first ? size / 2 : (size + 1) / 2;  // the half begun with has the odd one
    for (std::size_t i = 0; i < size; ++i) {
      const bool high = (i % 2 == 1) != high_first;
      order.push_back(begin + i / 2 + (high ? lower : 0));
    }
    high_first = (size % 2 == 0) != high_first;  // ended high: the next one's lower half is near
  }
  return order;
}

/// Lines over the strips in an order of theirs, or in that order from the other side; in the direction of the heading
/// or against it.
std::vector<Waypoint> lines_over(const Strips& strips, const SurveyOrder& order, std::span<const std::size_t> sequence,
                                 bool from_last, bool against) {
  const Vector2d along(std::cos(strips.heading_rad), std::sin(strips.heading_rad)), right(-along.y(), along.x());
  std::vector<Waypoint> waypoints;
  double sense = against ? -1 : 1;
  for (std::size_t i = 0; i < strips.strips.size(); ++i, sense = -sense) {
    const Strip& strip = strips.strips[from_last ? strips.strips.size() - 1 - sequence[i] : sequence[i]];
    // In the line's own axes: forward, and to its right
    const double enters = sense > 0 ? strip.low : -strip.high, leaves = sense > 0 ? strip.high : -strip.low;
    const double begin = enters - order.seen_m.max().x() - order.lead_in_m,
                 end = leaves - order.seen_m.min().x() + order.lead_out_m,
                 y = sense * strip.y - order.seen_m.center().y();
    for (const double x : {begin, end}) {
      const Vector2d place = sense * (x * along + y * right);
      waypoints.push_back({place.x(),
                           place.y(),
                           order.height_m,
                           std::remainder(strips.heading_rad + (sense > 0 ? 0 : pi), 2 * pi),
                           {},
                           order.airspeed_mps});
    }
  }
  return waypoints;
}

/// Of the ways between lines.
double turns_m(const std::vector<Waypoint>& waypoints, double radius_m) {
  double sum_m = 0;
  for (std::size_t i = 1; i + 1 < waypoints.size(); i += 2) {
    const auto pose = [&](std::size_t k) {
      return WayEnd::pose({waypoints[k].north_m, waypoints[k].east_m}, *waypoints[k].course_rad);
    };
    sum_m += shortest_way(pose(i), pose(i + 1), radius_m)->length_m;
  }
  return sum_m;
}

/// The order of lines with the shortest way.
std::vector<std::size_t> best_sequence(const Strips& strips, const SurveyOrder& order) {
  const std::size_t lines = strips.strips.size();
  std::vector<std::size_t> best(lines);
  std::iota(best.begin(), best.end(), std::size_t{0});
  if (!(order.turn_radius_m > 0) || !(strips.spacing_m > 0)) return best;
  const auto length_m = [&](const std::vector<std::size_t>& sequence) {
    return turns_m(lines_over(strips, order, sequence, false, false), order.turn_radius_m);
  };
  // Blocks just large enough for turns of two radii, and larger ones
  const auto wide = static_cast<std::size_t>(std::ceil(2 * order.turn_radius_m / strips.spacing_m - 1e-9));
  const std::size_t most_blocks = std::max<std::size_t>(1, lines / (2 * wide + 1));
  double least_m = length_m(best);
  for (std::size_t blocks = most_blocks > 2 ? most_blocks - 2 : 1; blocks <= most_blocks; ++blocks) {
    std::vector<std::size_t> sequence = by_halves(lines, blocks);
    const double sequence_m = length_m(sequence);
    if (!(sequence_m < least_m - 1e-6)) continue;
    least_m = sequence_m;
    best = std::move(sequence);
  }
  return best;
}

}  // namespace

Result<SurveyPlan> plan_survey(const Area& area, const SurveyOrder& order) {
  for (const double overlap : {order.forward_overlap, order.side_overlap})
    if (!(overlap >= 0 && overlap <= 0.95))
      return fail(Error::Kind::Malformed, fmt::format("expected an overlap from 0 to 0.95, found {}", overlap));
  if (!(order.lead_in_m >= 0 && order.lead_out_m >= 0 && order.turn_radius_m >= 0))
    return fail(Error::Kind::Malformed, "expected a lead-in, a lead-out and a turn radius from 0 m");
  const Vector2d size = order.seen_m.isEmpty() ? Vector2d::Zero() : Vector2d(order.seen_m.sizes());
  if (!(size.x() > 0 && size.y() > 0 && size.allFinite()))
    return fail(Error::Kind::Malformed, "the camera sees no rectangle of the ground in level flight");

  const Strips strips = order.heading_rad ? strips_at(area, *order.heading_rad, size.y(), order.side_overlap)
                                          : best_strips(area, size.y(), order.side_overlap);
  if (strips.strips.empty())
    return fail(Error::Kind::Malformed, fmt::format("would take more than {} lines {:.3g} m apart: fly higher, or "
                                                    "survey a smaller area",
                                                    most_lines, size.y() * (1 - order.side_overlap)));
  SurveyPlan plan;
  plan.lines = static_cast<int>(strips.strips.size());
  plan.line_spacing_m = strips.spacing_m;
  plan.exposure_spacing_m = size.x() * (1 - order.forward_overlap);
  plan.seen_at_least = at_least(order.forward_overlap) * at_least(order.side_overlap);
  const std::vector<std::size_t> sequence = best_sequence(strips, order);
  double nearest = INFINITY;
  for (const bool from_last : {false, true})
    for (const bool against : {false, true}) {
      auto waypoints = lines_over(strips, order, sequence, from_last, against);
      const Vector2d first(waypoints[0].north_m, waypoints[0].east_m);
      const double distance = order.from ? (first - *order.from).norm() : 0;
      if (!(distance < nearest - 1e-6)) continue;
      nearest = distance;
      plan.waypoints = std::move(waypoints);
    }
  plan.heading_rad = *plan.waypoints[0].course_rad;
  return plan;
}

}  // namespace nadir::sim

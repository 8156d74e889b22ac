#include "nadir/sim/dubins.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {
using Eigen::Vector2d;
constexpr double pi = std::numbers::pi;
constexpr double least_piece_m = 1e-6;
constexpr double rounding_rad = 1e-9;  // a turn that is this much short of a whole one is none

Vector2d right_of(double course_rad) { return {-std::sin(course_rad), std::cos(course_rad)}; }
double bearing_rad(const Vector2d& v) { return std::atan2(v.y(), v.x()); }

/// A circle to turn on: to the right where `curve_m`, its radius, is positive, to the left where negative. Where it is
/// 0, a point to pass in any direction.
struct Turn {
  Vector2d center;
  double curve_m = 0;
  std::optional<double> course_rad;  // at its free end

  double sense() const { return curve_m < 0 ? -1 : 1; }
  Vector2d at(double course) const { return center - curve_m * right_of(course); }
  /// From one course to another, [0, 2 pi).
  double sweep_rad(double from_rad, double to_rad) const {
    double sweep = std::fmod(sense() * (to_rad - from_rad), 2 * pi);
    if (sweep < 0) sweep += 2 * pi;
    return sweep > 2 * pi - rounding_rad ? 0 : sweep;
  }
  std::string letter() const { return curve_m > 0 ? "R" : curve_m < 0 ? "L" : ""; }
};

/// The turns that a way can begin or end with.
std::vector<Turn> turns_of(const WayEnd& end, double radius_m, bool left) {
  if (end.kind == WayEnd::Kind::Point) return {{end.place, 0, {}}};
  if (end.kind == WayEnd::Kind::Circle)
    return {
        {end.place, end.clockwise ? end.radius_m : -end.radius_m, left ? std::optional(end.course_rad) : std::nullopt}};
  const Vector2d right = radius_m * right_of(end.course_rad);
  return {{end.place + right, radius_m, end.course_rad}, {end.place - right, -radius_m, end.course_rad}};
}

void add_turn(Way& way, const Turn& turn, double from_rad, double sweep_rad) {
  const double length_m = std::abs(turn.curve_m) * sweep_rad;
  way.length_m += length_m;
  if (length_m < least_piece_m) return;
  CirclePath arc;
  arc.center = turn.center;
  arc.radius_m = std::abs(turn.curve_m);
  arc.clockwise = turn.curve_m > 0;
  arc.from_rad = std::remainder(from_rad - turn.sense() * (pi / 2), 2 * pi);
  arc.sweep_rad = sweep_rad;
  way.pieces.emplace_back(arc);
}

/// A turn, a straight along the tangent of both, a turn. Nothing where there is no such tangent.
/// Along the course x of the tangent, with n to its right, the points where it touches are c - curve n; so the centres
/// are apart by length x + (change of curve) n.
std::optional<Way> by_tangent(const Turn& a, const Turn& b) {
  const Vector2d apart = b.center - a.center;
  const double change_m = b.curve_m - a.curve_m, square = apart.squaredNorm() - change_m * change_m;
  if (square < -1e-9 * change_m * change_m) return std::nullopt;
  const double straight_m = std::sqrt(std::max(0.0, square));  // a point on the circle: rounding
  const bool one_circle = apart.norm() < least_piece_m && std::abs(change_m) < least_piece_m;
  const double course = one_circle ? a.course_rad.value_or(0) : bearing_rad(apart) - std::atan2(change_m, straight_m);

  Way way;
  way.word = a.letter() + "S" + b.letter();
  if (a.course_rad) way.first_turn_rad = a.sweep_rad(*a.course_rad, course);
  if (a.course_rad) add_turn(way, a, *a.course_rad, way.first_turn_rad);
  way.length_m += straight_m;
  if (straight_m >= least_piece_m) way.pieces.emplace_back(StraightPath{a.at(course), b.at(course), 0, 0});
  if (b.course_rad) add_turn(way, b, course, b.sweep_rad(course, *b.course_rad));
  way.arrival_course_rad = b.course_rad.value_or(course);
  return way;
}

/// A turn, and one of the same radius to the other side; then, unless `b` is a point, a third one, to the first's side.
/// Of the two places for the second one, by `side`, +1 or -1. Nothing where the ends are too far apart or too near.
std::optional<Way> by_turn(const Turn& a, const Turn& b, double side) {
  const Vector2d apart = b.center - a.center;
  const double radius = std::abs(a.curve_m), distance = apart.norm();
  if (distance < least_piece_m) return std::nullopt;
  // The second turn's centre lies at the sums of radii from both others
  const double from_a = 2 * radius, from_b = radius + std::abs(b.curve_m);
  const double forward = (distance * distance + from_a * from_a - from_b * from_b) / (2 * distance);
  if (std::abs(forward) > from_a) return std::nullopt;
  const Vector2d across(-apart.y(), apart.x());
  const Vector2d center = a.center + (forward / distance) * apart +
                          (side * std::sqrt(from_a * from_a - forward * forward) / distance) * across;
  const Turn middle{center, -a.curve_m, {}};
  // Where two turns touch, the way goes across the line of their centres
  const double first = bearing_rad(center - a.center) + a.sense() * (pi / 2),
               second = bearing_rad(b.center - center) + middle.sense() * (pi / 2);
  Way way;
  way.word = a.letter() + middle.letter() + b.letter();
  way.first_turn_rad = a.sweep_rad(*a.course_rad, first);
  add_turn(way, a, *a.course_rad, way.first_turn_rad);
  add_turn(way, middle, first, middle.sweep_rad(first, second));
  if (b.course_rad) add_turn(way, b, second, b.sweep_rad(second, *b.course_rad));
  way.arrival_course_rad = b.course_rad.value_or(second);
  return way;
}

}  // namespace

std::optional<Way> shortest_way(const WayEnd& from, const WayEnd& to, double radius_m) {
  assert(radius_m > 0);
  std::optional<Way> best;
  const auto offer = [&](std::optional<Way> way) {  // rounding does not choose between equals
    if (way && (!best || way->length_m < best->length_m - 1e-9 * (radius_m + best->length_m))) best = std::move(way);
  };
  const auto first = turns_of(from, radius_m, /*left=*/true), last = turns_of(to, radius_m, /*left=*/false);
  for (const Turn& a : first)
    for (const Turn& b : last) offer(by_tangent(a, b));
  if (from.kind == WayEnd::Kind::Pose && to.kind != WayEnd::Kind::Circle)
    for (std::size_t k = 0; k < 2; ++k)
      for (const double side : {1.0, -1.0}) offer(by_turn(first[k], last[k % last.size()], side));
  return best;
}

}  // namespace nadir::sim

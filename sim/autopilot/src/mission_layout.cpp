#include "mission_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nadir/sim/dubins.h"

namespace nadir::sim {
namespace {
using Eigen::Vector2d;
constexpr double pi = std::numbers::pi;

Vector2d plan(const Waypoint& w) { return {w.north_m, w.east_m}; }
double bearing_rad(const Vector2d& v) { return std::atan2(v.y(), v.x()); }
double height_m(const MissionItem& item) {
  return std::visit([](const auto& i) { return i.height_m; }, item);
}
std::optional<double> airspeed_mps(const MissionItem& item) {
  return std::visit([](const auto& i) { return i.airspeed_mps; }, item);
}
bool for_ever(const MissionItem& item) {
  const auto* orbit = std::get_if<Orbit>(&item);
  return orbit && !orbit->turns && !orbit->seconds;
}

/// Values that cannot be, each by itself.
class ItemFaults {
 public:
  ItemFaults(std::size_t item, std::vector<MissionFault>& out) : item_(item), out_(out) {}

  void operator()(const Waypoint& w) const {
    check_place(w.north_m, w.east_m, w.height_m);
    if (w.turn_radius_m && !(*w.turn_radius_m >= 0)) add("a turn radius from 0", *w.turn_radius_m, "m");
    if (w.course_rad && !std::isfinite(*w.course_rad)) add("a finite course", *w.course_rad, "rad");
    if (w.course_rad && w.turn_radius_m == 0) add("a turn radius above 0 where a course is asked for", 0, "m");
    check_positive("an airspeed", w.airspeed_mps, "m/s");
  }
  void operator()(const Orbit& o) const {
    check_place(o.north_m, o.east_m, o.height_m);
    check_positive("a radius", o.radius_m, "m");
    check_positive("a number of turns", o.turns, "");
    check_positive("a time", o.seconds, "s");
    if (o.turns && o.seconds) out_.push_back({item_, "expected turns or a time, found both"});
    check_positive("an airspeed", o.airspeed_mps, "m/s");
  }

 private:
  void add(const char* what, double found, const char* unit) const {
    out_.push_back({item_, fmt::format("expected {}, found {}{}{}", what, found, *unit ? " " : "", unit)});
  }
  void check_place(double north_m, double east_m, double height_m) const {
    if (!std::isfinite(north_m + east_m + height_m)) out_.push_back({item_, "a coordinate is not a finite number"});
  }
  void check_positive(const char* what, std::optional<double> value, const char* unit) const {
    if (value && !(*value > 0 && std::isfinite(*value))) add(fmt::format("{} above 0", what).c_str(), *value, unit);
  }
  std::size_t item_;
  std::vector<MissionFault>& out_;
};

/// An arc that touches two straights which meet in a corner, as far from it as `cut_m`.
struct Fillet {
  CirclePath arc;
  double cut_m = 0;
};

SharpCorner corner_between(const StraightPath& a, const StraightPath& b) {
  const Vector2d in = a.to - a.from, out = b.to - b.from;
  const double turn = std::atan2(std::abs(in.x() * out.y() - in.y() * out.x()), in.dot(out));
  if (turn > 165 * (pi / 180)) return {turn, 0};
  return {turn, 0.5 * std::min(in.norm(), out.norm()) / std::tan(turn / 2)};
}

Fillet fillet_between(const StraightPath& a, const StraightPath& b, double turn_rad, double radius_m) {
  const Vector2d in = a.to - a.from, out = b.to - b.from, u = in.normalized();
  Fillet fillet;
  fillet.cut_m = radius_m * std::tan(turn_rad / 2);
  const double sense = in.x() * out.y() - in.y() * out.x() > 0 ? 1 : -1;
  const Vector2d entry = a.to - fillet.cut_m * u;
  const Vector2d right(-u.y(), u.x());
  fillet.arc.center = entry + sense * radius_m * right;
  fillet.arc.radius_m = radius_m;
  fillet.arc.clockwise = sense > 0;
  fillet.arc.from_rad = bearing_rad(entry - fillet.arc.center);
  fillet.arc.sweep_rad = turn_rad;
  fillet.arc.from_height_m = a.to_height_m - (a.to_height_m - a.from_height_m) * fillet.cut_m / in.norm();
  fillet.arc.to_height_m = b.from_height_m + (b.to_height_m - b.from_height_m) * fillet.cut_m / out.norm();
  return fillet;
}

Vector2d on_circle(const CirclePath& circle, double bearing) {
  return circle.center + circle.radius_m * Vector2d(std::cos(bearing), std::sin(bearing));
}

/// A piece flown from its beginning to its end, with heights along it.
MissionPiece whole_piece(Path path, double from_height_m, double to_height_m) {
  return std::visit(
      [&](auto& p) {
        p.from_height_m = from_height_m;
        p.to_height_m = to_height_m;
        if constexpr (std::is_same_v<decltype(p), StraightPath&>) {
          return MissionPiece{p, p.from, p.to};
        } else {
          const double sense = p.clockwise ? 1 : -1;
          return MissionPiece{p, on_circle(p, p.from_rad), on_circle(p, p.from_rad + sense * p.sweep_rad), p.sweep_rad};
        }
      },
      path);
}

class Layer {
 public:
  Layer(const Waypoint& start, double turn_radius_m) : radius_m_(turn_radius_m), height_m_(start.height_m) {
    here_ = start.course_rad ? WayEnd::pose(plan(start), *start.course_rad) : WayEnd::point(plan(start));
    course_rad_ = start.course_rad.value_or(0);
  }

  /// The way to an item, and an orbit's own circle.
  void add(const MissionItem& item, std::size_t index) {
    item_ = index;
    airspeed_mps_ = airspeed_mps(item);
    std::visit([&](const auto& i) { add_item(i); }, item);
    height_m_ = sim::height_m(item);
  }

  /// A circle to the right that touches the way there, at the end.
  void add_last_circle() {
    CirclePath circle;
    circle.center = here_.place + radius_m_ * Vector2d(-std::sin(course_rad_), std::cos(course_rad_));
    circle.radius_m = radius_m_;
    circle.from_rad = bearing_rad(here_.place - circle.center);
    circle.from_height_m = circle.to_height_m = height_m_;
    add_circle(circle, 2 * pi).leaves = false;
  }

  std::vector<MissionPiece> pieces;
  std::vector<MissionFault> faults;

 private:
  void add_item(const Waypoint& to) {
    const double radius_m = to.turn_radius_m.value_or(radius_m_);
    const WayEnd end = to.course_rad ? WayEnd::pose(plan(to), *to.course_rad) : WayEnd::point(plan(to));
    WayEnd from = here_;
    if (to.course_rad && from.kind == WayEnd::Kind::Point) from = WayEnd::pose(from.place, course_rad_);
    if (radius_m == 0 && from.kind == WayEnd::Kind::Pose) from = WayEnd::point(from.place);
    const double turn_m = radius_m > 0 ? radius_m : radius_m_;  // without turns it does not count
    auto way = shortest_way(from, end, turn_m);
    if (!way) {  // from a circle around it: left as it was entered
      leave(pieces.back(), 0);
      from = WayEnd::pose(entry_, from.course_rad);
      way = shortest_way(from, end, turn_m);
    }
    if (way->length_m < 1 && (faults.empty() || faults.back().item != item_))
      faults.push_back({item_, "is less than 1 m from what comes before it, in plan"});
    add_way(*way, from, to.height_m);
    here_ = end;
    course_rad_ = way->arrival_course_rad;
    corner_radius_m_ = to.course_rad ? 0 : radius_m;
  }

  void add_item(const Orbit& to) {
    CirclePath circle;
    circle.center = {to.north_m, to.east_m};
    circle.radius_m = to.radius_m;
    circle.clockwise = to.clockwise;
    circle.from_height_m = circle.to_height_m = to.height_m;
    const double sense = to.clockwise ? 1 : -1;
    const auto way = shortest_way(here_, WayEnd::circle(circle.center, to.radius_m, to.clockwise), radius_m_);
    if (way) {
      add_way(*way, here_, to.height_m);
      course_rad_ = way->arrival_course_rad;
      circle.from_rad = std::remainder(course_rad_ - sense * (pi / 2), 2 * pi);
    } else {  // from within: the vector field leads out to it
      const Vector2d from = here_.kind == WayEnd::Kind::Circle ? entry_ : here_.place;
      circle.from_rad = bearing_rad(from - circle.center);
      course_rad_ = circle.from_rad + sense * (pi / 2);
    }
    entry_ = on_circle(circle, circle.from_rad);
    MissionPiece& piece = add_circle(circle, 2 * pi * to.turns.value_or(1));
    piece.seconds = to.seconds;
    piece.leaves = to.turns || to.seconds;
    here_ = WayEnd::circle(circle.center, to.radius_m, to.clockwise, course_rad_);
  }

  MissionPiece& add_circle(const CirclePath& circle, double turn_rad) {
    MissionPiece piece{circle, on_circle(circle, circle.from_rad), on_circle(circle, circle.from_rad), turn_rad};
    piece.airspeed_mps = airspeed_mps_;
    piece.item = item_;
    pieces.push_back(piece);
    return pieces.back();
  }

  /// Pieces of a way, with even change of height; the first turn off an orbit is the orbit's own.
  void add_way(const Way& way, const WayEnd& from, double to_height_m) {
    std::size_t first = 0;
    double flown_m = 0;
    if (from.kind == WayEnd::Kind::Circle) {
      MissionPiece& orbit = pieces.back();
      leave(orbit, way.first_turn_rad);
      const auto* turn = way.pieces.empty() ? nullptr : std::get_if<CirclePath>(&way.pieces[0]);
      first = turn && way.first_turn_rad > 0 && turn->center == std::get<CirclePath>(orbit.path).center;
    }
    double length_m = 0;
    for (std::size_t i = first; i < way.pieces.size(); ++i) length_m += sim::length_m(way.pieces[i]);
    const auto at = [&](double metres) { return height_m_ + (to_height_m - height_m_) * (metres / length_m); };
    for (std::size_t i = first; i < way.pieces.size(); ++i) {
      const double ends_m = flown_m + sim::length_m(way.pieces[i]);
      MissionPiece piece = whole_piece(way.pieces[i], at(flown_m), at(ends_m));
      flown_m = ends_m;
      piece.airspeed_mps = airspeed_mps_;
      piece.item = item_;
      if (i == 0 && from.kind == WayEnd::Kind::Point) add_fillet(piece);
      pieces.push_back(piece);
    }
  }

  /// An orbit is left where it has turned so far from its entry, after whole rounds.
  static void leave(MissionPiece& orbit, double exit_rad) {
    const auto& circle = std::get<CirclePath>(orbit.path);
    const double rounds = std::ceil((orbit.turn_rad - exit_rad) / (2 * pi) - 1e-6);
    orbit.turn_rad = exit_rad + 2 * pi * std::max(0.0, rounds);
    orbit.end = on_circle(circle, circle.from_rad + (circle.clockwise ? 1 : -1) * exit_rad);
  }

  /// Between the piece before and `next`, where both are straight and meet in a corner.
  void add_fillet(MissionPiece& next) {
    if (pieces.empty() || !(corner_radius_m_ > 0)) return;
    MissionPiece& before = pieces.back();
    if (!std::holds_alternative<StraightPath>(before.path) || !std::holds_alternative<StraightPath>(next.path)) return;
    const auto &a = std::get<StraightPath>(before.path), &b = std::get<StraightPath>(next.path);
    const SharpCorner corner = corner_between(a, b);
    if (corner.turn_rad < 1e-3) return;
    if (corner_radius_m_ > corner.fitting_radius_m) {
      before.corner = corner;
      return;
    }
    const Fillet fillet = fillet_between(a, b, corner.turn_rad, corner_radius_m_);
    MissionPiece arc = whole_piece(fillet.arc, fillet.arc.from_height_m, fillet.arc.to_height_m);
    arc.airspeed_mps = before.airspeed_mps;
    arc.item = before.item;
    before.end = arc.begin = a.to - fillet.cut_m * (a.to - a.from).normalized();
    next.begin = arc.end = b.from + fillet.cut_m * (b.to - b.from).normalized();
    pieces.push_back(arc);
  }

  const double radius_m_;
  WayEnd here_;
  Vector2d entry_ = Vector2d::Zero();  // of the orbit under way
  double course_rad_ = 0, height_m_ = 0, corner_radius_m_ = 0;
  std::size_t item_ = 0;
  std::optional<double> airspeed_mps_;
};

}  // namespace

MissionLayout lay_out(const Waypoint& start, std::span<const MissionItem> items, double turn_radius_m,
                      AfterMission after) {
  MissionLayout layout;
  std::vector<MissionFault>& faults = layout.faults;
  const bool repeats = after == AfterMission::Repeat;
  if (items.empty()) faults.push_back({{}, "expected at least one waypoint, found none"});
  if (!(turn_radius_m > 0 && std::isfinite(turn_radius_m)))
    faults.push_back({{}, fmt::format("expected a turn radius above 0, found {} m", turn_radius_m)});
  if (!std::isfinite(start.north_m + start.east_m + start.height_m + start.course_rad.value_or(0)))
    faults.push_back({{}, "the start: a coordinate is not a finite number"});
  if (repeats && items.size() == 1) faults.push_back({{}, "expected at least two waypoints to repeat, found one"});
  for (std::size_t i = 0; i < items.size(); ++i) {
    std::visit(ItemFaults(i, faults), items[i]);
    if (for_ever(items[i]) && (after != AfterMission::Circle || i + 1 < items.size()))
      faults.push_back({i, "goes on for ever, so that what follows is never reached: give it turns or a time"});
  }
  if (!faults.empty()) return layout;

  // One that repeats is laid for two rounds: the way to its first item is another one than from the start, and with it
  // where that item is left. The second round begins as each one after it.
  Layer layer(start, turn_radius_m);
  for (std::size_t i = 0; i < items.size(); ++i) layer.add(items[i], i);
  if (repeats) {
    layer.add(items[0], 0);
    layout.again = layer.pieces.size();
    for (std::size_t i = 1; i <= items.size(); ++i) layer.add(items[i % items.size()], i % items.size());
    // What follows decides how the first item is left; that way itself is laid already
    const std::size_t end = layer.pieces.size();
    layer.add(items[1], 1);
    layer.pieces.erase(layer.pieces.begin() + static_cast<std::ptrdiff_t>(end), layer.pieces.end());
  } else if (after == AfterMission::Circle) {
    if (std::holds_alternative<Waypoint>(items.back()))
      layer.add_last_circle();
    else
      layer.pieces.back().leaves = false;
  }
  layout.faults = std::move(layer.faults);
  if (layout.faults.empty()) layout.pieces = std::move(layer.pieces);
  return layout;
}

}  // namespace nadir::sim

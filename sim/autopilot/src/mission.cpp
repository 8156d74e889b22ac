#include "nadir/sim/mission.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "mission_layout.h"

namespace nadir::sim {
namespace {
using Eigen::Vector2d;
constexpr double pi = std::numbers::pi;

double sense_of(const CirclePath& circle) { return circle.clockwise ? 1 : -1; }

/// A place on a piece, `metres` after its beginning.
PlannedPoint point_at(const MissionPiece& piece, double metres) {
  PlannedPoint point;
  if (const auto* line = std::get_if<StraightPath>(&piece.path)) {
    const Vector2d whole = line->to - line->from, along = whole.normalized();
    const Vector2d p = piece.begin + metres * along;
    point.north_m = p.x(), point.east_m = p.y();
    point.course_rad = std::atan2(along.y(), along.x());
    point.slope = (line->to_height_m - line->from_height_m) / whole.norm();
    point.height_m = line->from_height_m + point.slope * (p - line->from).dot(along);
  } else {
    const auto& circle = std::get<CirclePath>(piece.path);
    const double turned = metres / circle.radius_m, bearing = circle.from_rad + sense_of(circle) * turned;
    point.north_m = circle.center.x() + circle.radius_m * std::cos(bearing);
    point.east_m = circle.center.y() + circle.radius_m * std::sin(bearing);
    point.course_rad = bearing + sense_of(circle) * (pi / 2);
    point.curve_per_m = sense_of(circle) / circle.radius_m;
    const double climb_m = circle.to_height_m - circle.from_height_m;
    point.height_m = circle.to_height_m;
    if (turned < circle.sweep_rad) {
      point.height_m = circle.from_height_m + climb_m * turned / circle.sweep_rad;
      point.slope = climb_m / (circle.radius_m * circle.sweep_rad);
    }
  }
  point.airspeed_mps = piece.airspeed_mps;
  point.item = piece.item;
  return point;
}

}  // namespace

double MissionPiece::length_m() const {
  if (const auto* circle = std::get_if<CirclePath>(&path)) return circle->radius_m * turn_rad;
  return (end - begin).norm();
}

std::vector<MissionFault> Mission::faults(const Waypoint& start, std::span<const MissionItem> items,
                                          double turn_radius_m, AfterMission after) {
  return lay_out(start, items, turn_radius_m, after).faults;
}

Result<Mission> Mission::create(const Waypoint& start, std::span<const MissionItem> items, double turn_radius_m,
                                AfterMission after) {
  MissionLayout layout = lay_out(start, items, turn_radius_m, after);
  if (!layout.faults.empty()) {
    std::string message;
    for (const MissionFault& f : layout.faults)
      message += fmt::format("{}mission: {}{}", message.empty() ? "" : "\n",
                             f.item ? fmt::format("waypoint {}: ", *f.item + 1) : "", f.message);
    return fail(Error::Kind::Malformed, message);
  }
  Mission mission;
  mission.pieces_ = std::move(layout.pieces);
  mission.after_ = after;
  mission.again_ = layout.again;
  mission.finished_ = after == AfterMission::Circle && mission.pieces_.size() == 1;
  return mission;
}

bool Mission::passed(const MissionPiece& piece, const Navigation& now, double time_s) {
  const Vector2d here(now.north_m, now.east_m);
  if (const auto* line = std::get_if<StraightPath>(&piece.path))
    return (here - piece.end).dot(line->to - line->from) >= 0;
  if (!here.allFinite()) return false;

  // How far round: from the piece's beginning, and then in small steps, so that whole rounds count
  const auto& circle = std::get<CirclePath>(piece.path);
  const double bearing = std::atan2(here.y() - circle.center.y(), here.x() - circle.center.x());
  if (!round_) round_ = {circle.from_rad, 0, time_s};
  round_->turned_rad += std::remainder(sense_of(circle) * (bearing - round_->bearing_rad), 2 * pi);
  round_->bearing_rad = bearing;
  if (!piece.leaves) return false;
  if (!piece.seconds) return round_->turned_rad >= piece.turn_rad;
  if (time_s - round_->since_s < *piece.seconds) return false;
  if (std::isinf(round_->to_turn_rad)) {  // time is up: on to where it is left
    const double rounds = std::ceil((round_->turned_rad - piece.turn_rad) / (2 * pi));
    round_->to_turn_rad = piece.turn_rad + 2 * pi * rounds;
  }
  return round_->turned_rad >= round_->to_turn_rad;
}

const MissionPiece& Mission::piece_at(const Navigation& now, double time_s) {
  // At most one round: pieces end in turn, and a vehicle that is not finite passes nothing.
  for (std::size_t n = 0; n < pieces_.size() && !finished_ && passed(pieces_[current_], now, time_s); ++n) {
    if (current_ + 1 < pieces_.size())
      ++current_;
    else if (after_ == AfterMission::Repeat)
      current_ = again_;
    else
      finished_ = true;
    if (after_ == AfterMission::Circle) finished_ = current_ + 1 == pieces_.size();
    round_.reset();
  }
  return pieces_[current_];
}

std::vector<PlannedPoint> planned_points(const Mission& mission, double spacing_m) {
  assert(spacing_m > 0);
  std::vector<PlannedPoint> points;
  for (const MissionPiece& piece : mission.pieces()) {
    const double length = piece.length_m();
    const auto steps = static_cast<std::size_t>(std::ceil(std::max(length / spacing_m, 1.0)));
    for (std::size_t i = 0; i <= steps; ++i) {
      PlannedPoint point = point_at(piece, length * static_cast<double>(i) / static_cast<double>(steps));
      point.length_m = piece.leaves ? length / static_cast<double>(steps + 1) : 0;
      if (i == steps) point.corner = piece.corner;
      points.push_back(point);
    }
  }
  return points;
}

}  // namespace nadir::sim

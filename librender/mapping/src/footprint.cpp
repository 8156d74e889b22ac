#include "nadir/render/footprint.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "seen_ground.h"

namespace nadir::render {
namespace {

Eigen::Vector3d on_unit_sphere(const Eigen::Vector2d& lon_lat) {
  const double c = std::cos(lon_lat.y());
  return {c * std::cos(lon_lat.x()), c * std::sin(lon_lat.x()), std::sin(lon_lat.y())};
}

double least_turn(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

/// Distance, in Earth radii, between a place and the nearest one, where it lies, of the line in longitude and latitude
/// from `a` to `b`.
double departure(Eigen::Vector2d a, Eigen::Vector2d b, const Eigen::Vector2d& place) {
  // At a pole a line has the longitude of its other end
  constexpr double pole = std::numbers::pi / 2 - 1e-12;
  if (std::abs(a.y()) > pole) a.x() = b.x();
  if (std::abs(b.y()) > pole) b.x() = a.x();
  const Eigen::Vector2d line(least_turn(b.x() - a.x()), b.y() - a.y());
  const Eigen::Vector2d off(line.x() / 2 + least_turn(place.x() - a.x() - line.x() / 2), place.y() - a.y());
  const Eigen::Array2d scale(std::cos(place.y()), 1);
  const Eigen::Vector2d scaled_line = line.array() * scale, scaled_off = off.array() * scale;
  const double square = scaled_line.squaredNorm();
  const double t = square > 0 ? std::clamp(scaled_line.dot(scaled_off) / square, 0.0, 1.0) : 0;
  return (on_unit_sphere(a + t * line) - on_unit_sphere(place)).norm();
}

/// Whether the lines in longitude and latitude from `a` to `b` and from `c` to `d` cross, not counting their ends.
bool cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c, const Eigen::Vector2d& d) {
  if (b == c || d == a) return false;
  const auto away = [](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    return Eigen::Vector2d(least_turn(to.x() - from.x()), to.y() - from.y());
  };
  const auto turns = [](const Eigen::Vector2d& u, const Eigen::Vector2d& v) { return u.x() * v.y() - u.y() * v.x(); };
  const Eigen::Vector2d ab = away(a, b), cd = away(c, d), middles = away(a + ab / 2, c + cd / 2);
  const Eigen::Vector2d ac = ab / 2 + middles - cd / 2;
  const double c_side = turns(ab, ac), d_side = turns(ab, ac + cd), a_side = turns(cd, -ac),
               b_side = turns(cd, ab - ac);
  return c_side * d_side < 0 && a_side * b_side < 0;
}

/// A place on an arc.
struct Knot {
  double s;
  Eigen::Vector2d lon_lat;
  bool settled = false;  // the line to the next knot is within the tolerance
  bool crosses = false;  // that line another one
};

/// An arc as knots from its start to its end.
struct Drawn {
  Arc arc;
  std::vector<Knot> knots;
};

class Drawing {
 public:
  explicit Drawing(const SeenGround& ground) : ground_(ground) {}

  void add(const Loop& loop) {
    // Where two arcs join: on the horizon, if it is one of them, since rays that graze have no exact hit
    std::vector<std::optional<Eigen::Vector2d>> starts;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Arc& before = loop[(i + loop.size() - 1) % loop.size()];
      const bool at_end = before.kind == Arc::Kind::Horizon;
      auto place = at_end ? ground_.lon_lat(before, 1) : ground_.lon_lat(loop[i], 0);
      if (!place) place = at_end ? ground_.lon_lat(loop[i], 0) : ground_.lon_lat(before, 1);
      starts.push_back(place);
    }
    std::vector<Drawn> ring;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      Drawn drawn{loop[i], {}};
      // An eighth of a turn at most, as the tolerance's unit is the greatest distance between knots
      const bool round = loop[i].kind != Arc::Kind::ImageLine;
      const int parts = round ? std::max(1, static_cast<int>(std::ceil((loop[i].to.x() - loop[i].from.x()) /
                                                                       (std::numbers::pi / 4) * (1 - 1e-9))))
                              : 1;
      if (starts[i]) drawn.knots.push_back({0, *starts[i]});
      for (int k = 1; k < parts; ++k) {
        const double s = static_cast<double>(k) / parts;
        if (const auto place = ground_.lon_lat(loop[i], s)) drawn.knots.push_back({s, *place});
      }
      if (const auto& end = starts[(i + 1) % loop.size()]) drawn.knots.push_back({1, *end});
      ring.push_back(std::move(drawn));
    }
    rings_.push_back(std::move(ring));
  }

  void refine() {
    constexpr double rounding = 1e-14;
    const double tolerance = std::max(outline_tolerance * size(), rounding);
    constexpr int most_halvings = 30;
    for (int i = 0; i < most_halvings && points() < most_outline_points; ++i) {
      bool changed = false;
      for (auto& ring : rings_)
        for (Drawn& drawn : ring) changed = halve(drawn, tolerance) || changed;
      // Lines within the tolerance may cross, next to a pole above all; what they stand for does not
      if (!changed && !unsettle_crossing_lines()) break;
    }
  }

  /// The longest first.
  std::vector<Outline> outlines() const {
    std::vector<std::pair<double, Outline>> measured;
    for (const auto& ring : rings_) {
      Outline outline;
      for (const Drawn& drawn : ring)
        for (std::size_t k = 0; k + 1 < drawn.knots.size(); ++k) outline.push_back(drawn.knots[k].lon_lat);
      double length = 0;
      for (std::size_t i = 0; i < outline.size(); ++i)
        length += (on_unit_sphere(outline[(i + 1) % outline.size()]) - on_unit_sphere(outline[i])).norm();
      // What a lens shows may end in a single ray
      constexpr double nothing = 1e-14;
      if (length > nothing) measured.emplace_back(length, std::move(outline));
    }
    std::stable_sort(measured.begin(), measured.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<Outline> result;
    for (auto& [length, outline] : measured) result.push_back(std::move(outline));
    return result;
  }

 private:
  std::size_t points() const {
    std::size_t count = 0;
    for (const auto& ring : rings_)
      for (const Drawn& drawn : ring) count += drawn.knots.size();
    return count;
  }

  /// Greatest distance between two knots, in Earth radii.
  double size() const {
    std::vector<Eigen::Vector3d> places;
    for (const auto& ring : rings_)
      for (const Drawn& drawn : ring)
        for (const Knot& knot : drawn.knots) places.push_back(on_unit_sphere(knot.lon_lat));
    double greatest = 0;
    for (std::size_t i = 0; i < places.size(); ++i)
      for (std::size_t k = 0; k < i; ++k) greatest = std::max(greatest, (places[i] - places[k]).norm());
    return greatest;
  }

  bool unsettle_crossing_lines() {
    std::vector<std::pair<Knot*, const Knot*>> lines;
    for (auto& ring : rings_)
      for (Drawn& drawn : ring)
        for (std::size_t k = 0; k + 1 < drawn.knots.size(); ++k)
          lines.emplace_back(&drawn.knots[k], &drawn.knots[k + 1]);
    bool found = false;
    for (std::size_t i = 0; i < lines.size(); ++i)
      for (std::size_t k = i + 1; k < lines.size(); ++k) {
        if (!cross(lines[i].first->lon_lat, lines[i].second->lon_lat, lines[k].first->lon_lat,
                   lines[k].second->lon_lat))
          continue;
        for (Knot* knot : {lines[i].first, lines[k].first}) {
          knot->settled = false;
          knot->crosses = true;
        }
        found = true;
      }
    return found;
  }

  /// A place of the arc about halfway between two others on the ground: towards the horizon that is far from halfway in
  /// the image.
  std::optional<Knot> between(const Arc& arc, const Knot& from, const Knot& to) const {
    const Eigen::Vector3d start = on_unit_sphere(from.lon_lat), end = on_unit_sphere(to.lon_lat);
    double low = from.s, high = to.s;
    constexpr int most_steps = 40;
    for (int i = 0;; ++i) {
      const double s = (low + high) / 2;
      const auto place = ground_.lon_lat(arc, s);
      if (!place) return std::nullopt;
      const Eigen::Vector3d here = on_unit_sphere(*place);
      const double to_start = (here - start).squaredNorm(), to_end = (here - end).squaredNorm();
      constexpr double uneven = 4;
      if ((to_start <= uneven * to_end && to_end <= uneven * to_start) || i == most_steps) return Knot{s, *place};
      (to_start > to_end ? high : low) = s;
    }
  }

  /// Adds the middle of each line that departs from the arc; whether there was one.
  bool halve(Drawn& drawn, double tolerance) const {
    std::vector<Knot> finer;
    bool changed = false;
    for (std::size_t i = 0; i < drawn.knots.size(); ++i) {
      finer.push_back(drawn.knots[i]);
      if (finer.back().settled || i + 1 == drawn.knots.size()) continue;
      const Knot &from = drawn.knots[i], &to = drawn.knots[i + 1];
      const auto within = [&](const std::optional<Knot>& knot) {
        constexpr double margin = 0.8;  // what lies between the places looked at may depart a little more
        return !knot || departure(from.lon_lat, to.lon_lat, knot->lon_lat) <= margin * tolerance;
      };
      const auto middle = between(drawn.arc, from, to);
      const bool crosses = std::exchange(finer.back().crosses, false);
      finer.back().settled = !middle || (!crosses && within(middle) && within(between(drawn.arc, from, *middle)) &&
                                         within(between(drawn.arc, *middle, to)));
      if (finer.back().settled) continue;
      finer.push_back(*middle);
      changed = true;
    }
    drawn.knots = std::move(finer);
    return changed;
  }

  const SeenGround& ground_;
  std::vector<std::vector<Drawn>> rings_;
};

}  // namespace

Footprint footprint(const ExactChain& chain, const geodesy::Projection& projection) {
  const double w = chain.camera().width_px(), h = chain.camera().height_px();
  const std::array<Eigen::Vector2d, 4> corners = {Eigen::Vector2d(0, 0), {w, 0}, {w, h}, {0, h}};
  std::array<Eigen::Vector2d, 4> lon_lat;
  chain.lon_lat_from_image(corners, lon_lat);
  std::array<Eigen::Vector2d, 4> crs = lon_lat;
  projection.crs_from_lon_lat(crs);

  Footprint result;
  for (std::size_t i = 0; i < 4; ++i)
    if (const auto enu = chain.enu_from_image(corners[i])) result.corners[i] = GroundPoint{*enu, lon_lat[i], crs[i]};

  const SeenGround ground(chain);
  Drawing drawing(ground);
  for (const Loop& loop : ground.loops()) drawing.add(loop);
  drawing.refine();
  auto outlines = drawing.outlines();
  if (outlines.empty()) return result;
  result.outline_lon_lat_rad = std::move(outlines.front());
  result.more_outlines_lon_lat_rad.assign(std::make_move_iterator(outlines.begin() + 1),
                                          std::make_move_iterator(outlines.end()));
  return result;
}

}  // namespace nadir::render

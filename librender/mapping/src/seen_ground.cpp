#include "seen_ground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

namespace nadir::render {
using namespace geodesy;
namespace {

constexpr double turn = 2 * std::numbers::pi;

Eigen::Vector2d lon_lat_of_ecef(const Eigen::Vector3d& ecef) {
  const Geodetic place = geodetic_from_ecef({ecef});
  return {place.lon_rad, place.lat_rad};
}

}  // namespace

/// The border of an area of directions.
struct SeenGround::Border {
  Arc::Kind kind;
  std::function<double(const Arc&, double)> inside;  // of a place on an arc of another border: positive within
  std::function<double(const Eigen::Vector3d&)> angle;
  int samples = 16;     // an arc is looked at in so many pieces
  bool smooth = false;  // `inside`: two changes of sign within one piece are found, too
  double to_spare = 0;  // of an arc: it is cut that far within the border

  Arc arc(double from, double to) const { return {kind, {from, 0}, {to, 0}}; }
};

struct SeenGround::Crossing {
  std::size_t arc;
  double s;
  bool enters;
  double angle;  // on the border
};

namespace {

/// Where in [a, b] `f` comes nearest to changing its sign, or has changed it.
template <class F>
double towards_zero(const F& f, double a, double b) {
  const double sign = f(a) > 0 ? 1 : -1;
  for (int i = 0; i < 40; ++i) {
    const double p = a + (b - a) / 3, q = b - (b - a) / 3;
    const double at_p = sign * f(p), at_q = sign * f(q);
    if (!(at_p > 0)) return p;
    if (!(at_q > 0)) return q;
    (at_p < at_q ? b : a) = at_p < at_q ? q : p;
  }
  return (a + b) / 2;
}

/// Parameters in [0, 1] just before and just after each place where `f` changes its sign.
template <class F>
std::vector<std::pair<double, double>> sign_changes(const F& f, int samples, bool smooth) {
  std::vector<std::pair<double, double>> at;  // s, f(s)
  for (int i = 0; i <= samples; ++i) {
    const double s = static_cast<double>(i) / samples;
    at.emplace_back(s, f(s));
  }
  if (smooth) {
    std::vector<std::pair<double, double>> more;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const auto &before = at[i > 0 ? i - 1 : 0], &after = at[std::min(i + 1, at.size() - 1)];
      const double value = at[i].second, size = std::abs(value);
      const bool alike = (before.second > 0) == (value > 0) && (after.second > 0) == (value > 0);
      if (!alike || size > std::abs(before.second) || size > std::abs(after.second)) continue;
      const double nearest = towards_zero(f, before.first, after.first), there = f(nearest);
      if ((there > 0) != (value > 0)) more.emplace_back(nearest, there);
    }
    at.insert(at.end(), more.begin(), more.end());
    std::sort(at.begin(), at.end());
  }
  std::vector<std::pair<double, double>> changes;
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    if ((at[i].second > 0) == (at[i + 1].second > 0)) continue;
    double before = at[i].first, after = at[i + 1].first;
    for (int k = 0; k < 60; ++k) {
      const double middle = (before + after) / 2;
      ((f(middle) > 0) == (at[i].second > 0) ? before : after) = middle;
    }
    changes.emplace_back(before, after);
  }
  return changes;
}

}  // namespace

SeenGround::SeenGround(const ExactChain& chain) : chain_(chain) {
  const double above_m = chain.height_above_ground_m();
  if (!(above_m > 0)) return;
  if (chain.surface().plane()) {
    // As far as ExactChain::visibility counts a plane as ground
    const double reach_m = ExactChain::plane_reach_m(above_m);
    cos_edge_ = above_m / reach_m;
    axis_ = -Eigen::Vector3d::UnitZ();
    right_ = Eigen::Vector3d::UnitX();
    middle_ = chain.enu_from_camera().origin + above_m * axis_;
    radius_ = std::sqrt(reach_m * reach_m - above_m * above_m);
    above_ground_ = true;
  } else {
    // Source: Cozzi and Ring, 3D Engine Design for Virtual Globes, 2011, section 7.1
    const Eigen::Vector3d from = chain.surface().ellipsoid()->to_unit_sphere(chain.ecef_from_camera().origin);
    const double square = from.squaredNorm();
    above_ground_ = square > 1;
    if (!above_ground_) return;
    cos_edge_ = radius_ = std::sqrt((square - 1) / square);
    axis_ = -from.normalized();
    right_ = axis_.unitOrthogonal();
    middle_ = from / square;
  }
  down_ = axis_.cross(right_);
}

/// A camera ray as a unit vector in the axes of the horizon's circle.
Eigen::Vector3d SeenGround::ground_direction(const Eigen::Vector3d& camera_ray) const {
  if (const Ellipsoid* ellipsoid = chain_.surface().ellipsoid())
    return ellipsoid->to_unit_sphere(chain_.ecef_from_camera().rotation * camera_ray).normalized();
  return (chain_.enu_from_camera().rotation * camera_ray).normalized();
}

/// A point of the horizon: in the scene's frame over a plane, else in ECEF.
Eigen::Vector3d SeenGround::horizon(double angle) const {
  const Eigen::Vector3d point = middle_ + radius_ * (std::cos(angle) * right_ + std::sin(angle) * down_);
  if (const Ellipsoid* ellipsoid = chain_.surface().ellipsoid())
    return point.cwiseQuotient(ellipsoid->to_unit_sphere(Eigen::Vector3d::Ones()));
  return point;
}

Eigen::Vector3d SeenGround::towards_horizon(double angle) const {
  if (chain_.surface().ellipsoid())
    return chain_.ecef_from_camera().rotation.conjugate() * (horizon(angle) - chain_.ecef_from_camera().origin);
  return chain_.enu_from_camera().rotation.conjugate() * (horizon(angle) - chain_.enu_from_camera().origin);
}

std::optional<Eigen::Vector2d> SeenGround::lon_lat_of(const Eigen::Vector3d& camera_ray) const {
  if (const Plane* plane = chain_.surface().plane()) {
    const auto hit = plane->hit({chain_.enu_from_camera().origin}, {chain_.enu_from_camera().rotation * camera_ray});
    if (!hit) return std::nullopt;
    return lon_lat_of_ecef((plane->frame().ecef_from_enu() * *hit).xyz);
  }
  const auto hit = chain_.surface().ellipsoid()->hit({chain_.ecef_from_camera().origin},
                                                     {chain_.ecef_from_camera().rotation * camera_ray});
  if (!hit) return std::nullopt;
  return lon_lat_of_ecef(hit->xyz);
}

/// The last ray that the lens shows at an angle about its axis.
Eigen::Vector3d SeenGround::lens_edge(double angle) const {
  const Lens& lens = chain_.camera().lens();
  const Eigen::Vector2d aside(std::cos(angle), std::sin(angle));
  if (lens.model() == LensModel::equidistant) {
    const double off = lens.valid_radius() * (1 - 1e-12);
    return {aside.x() * std::sin(off), aside.y() * std::sin(off), std::cos(off)};
  }
  // Tangential distortion may dent what the radial part alone would show
  constexpr double greatest = 1e4;  // a tangent of 89.99 degrees: no pinhole looks farther aside
  double shown = 0, beyond = std::min(lens.valid_radius(), greatest);
  for (int i = 0; i < 50; ++i) {
    const double middle = (shown + beyond) / 2;
    (lens.image_of((middle * aside).homogeneous()) ? shown : beyond) = middle;
  }
  return (shown * aside).homogeneous().normalized();
}

bool SeenGround::within_image(const Eigen::Vector3d& camera_ray) const {
  const auto at = chain_.camera().image_of(camera_ray);
  return at && (at->array() >= 0).all() && at->x() <= chain_.camera().width_px() &&
         at->y() <= chain_.camera().height_px();
}

std::optional<Eigen::Vector3d> SeenGround::ray(const Arc& arc, double s) const {
  switch (arc.kind) {
    case Arc::Kind::ImageLine:
      return chain_.camera().ray_of(arc.at(s));
    case Arc::Kind::LensEdge:
      return lens_edge(arc.at(s).x());
    case Arc::Kind::Horizon:
      break;
  }
  return towards_horizon(arc.at(s).x());
}

std::optional<Eigen::Vector2d> SeenGround::lon_lat(const Arc& arc, double s) const {
  switch (arc.kind) {
    case Arc::Kind::ImageLine: {
      const Eigen::Vector2d image = arc.at(s);
      Eigen::Vector2d place;
      chain_.lon_lat_from_image({&image, 1}, {&place, 1});
      return place.allFinite() ? std::optional(place) : std::nullopt;
    }
    case Arc::Kind::LensEdge:
      return lon_lat_of(lens_edge(arc.at(s).x()));
    case Arc::Kind::Horizon:
      break;
  }
  const Eigen::Vector3d point = horizon(arc.at(s).x());
  if (const Plane* plane = chain_.surface().plane())
    return lon_lat_of_ecef((plane->frame().ecef_from_enu() * Point<frame::Enu>{point}).xyz);
  return lon_lat_of_ecef(point);
}

Loop SeenGround::image_loop() const {
  const double w = chain_.camera().width_px(), h = chain_.camera().height_px();
  const std::array<Eigen::Vector2d, 4> corners = {Eigen::Vector2d(0, 0), {w, 0}, {w, h}, {0, h}};
  Loop loop;
  for (std::size_t i = 0; i < 4; ++i) loop.push_back({Arc::Kind::ImageLine, corners[i], corners[(i + 1) % 4]});
  return loop;
}

/// The image's part where visibility, linear in it, is positive; the cut lies just inside.
Loop SeenGround::flat_loop() const {
  std::vector<Eigen::Vector2d> clipped;
  for (const Arc& side : image_loop()) {
    const double from = chain_.visibility(side.from), to = chain_.visibility(side.to);
    if (from > 0) clipped.push_back(side.from);
    if ((from > 0) == (to > 0)) continue;
    constexpr double inside = 1e-9;
    const double s = from / (from - to);
    clipped.push_back(side.at(from > 0 ? s * (1 - inside) : s + (1 - s) * inside));
  }
  Loop loop;
  for (std::size_t i = 0; i < clipped.size(); ++i)
    loop.push_back({Arc::Kind::ImageLine, clipped[i], clipped[(i + 1) % clipped.size()]});
  return loop;
}

/// Where a loop crosses a border, along the loop.
std::vector<SeenGround::Crossing> SeenGround::crossings(const Loop& loop, const Border& border) const {
  std::vector<Crossing> found;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const auto inside = [&](double s) { return border.inside(loop[i], s); };
    for (const auto& [before, after] : sign_changes(inside, border.samples, border.smooth)) {
      const bool enters = inside(after) > 0;
      const double s = enters ? std::min(after + border.to_spare, 1.0) : std::max(before - border.to_spare, 0.0);
      if (const auto there = ray(loop[i], s)) found.push_back({i, s, enters, border.angle(*there)});
    }
  }
  return found;
}

/// The part of what `loop` surrounds that lies within `border`. Both are walked clockwise: along the loop until it
/// leaves, then along the border to where the loop enters next. Where they do not meet, one lies within the other
/// (`border_within`: the border in the loop), each holds the other's border, or they lie apart. Source: Weiler and
/// Atherton, Hidden surface removal using polygon area sorting, 1977.
std::vector<Loop> SeenGround::cut(const Loop& loop, const Border& border, bool border_within) const {
  const std::vector<Crossing> met = crossings(loop, border);
  std::vector<Loop> result;
  const auto entries = std::count_if(met.begin(), met.end(), [](const Crossing& c) { return c.enters; });
  if (entries == 0 || entries == std::ssize(met)) {
    if (border.inside(loop[0], 0) > 0) result.push_back(loop);
    if (border_within) result.push_back({border.arc(0, turn)});
    return result;
  }
  const auto clockwise = [](double from, double to) { return std::fmod(to - from + 2 * turn, turn); };
  std::vector<bool> used(met.size(), false);
  for (std::size_t first = 0; first < met.size(); ++first) {
    if (!met[first].enters || used[first]) continue;
    Loop ring;
    std::size_t here = first;
    do {
      used[here] = true;
      // Along the loop
      std::size_t out = (here + 1) % met.size();
      while (met[out].enters) out = (out + 1) % met.size();
      const Crossing &a = met[here], &b = met[out];
      if (a.arc == b.arc && a.s <= b.s) {
        ring.push_back(loop[a.arc].part(a.s, b.s));
      } else {
        ring.push_back(loop[a.arc].part(a.s, 1));
        for (std::size_t i = (a.arc + 1) % loop.size(); i != b.arc; i = (i + 1) % loop.size()) ring.push_back(loop[i]);
        ring.push_back(loop[b.arc].part(0, b.s));
      }
      // Along the border
      std::size_t next = first;
      for (std::size_t i = 0; i < met.size(); ++i)
        if (met[i].enters && !used[i] && clockwise(b.angle, met[i].angle) < clockwise(b.angle, met[next].angle))
          next = i;
      ring.push_back(border.arc(b.angle, b.angle + clockwise(b.angle, met[next].angle)));
      here = next;
    } while (here != first);
    result.push_back(std::move(ring));
  }
  return result;
}

std::vector<Loop> SeenGround::loops() const {
  if (!above_ground_) return {};
  if (chain_.flat()) {
    Loop loop = flat_loop();
    if (loop.empty()) return {};
    return {std::move(loop)};
  }
  const Loop image = image_loop();
  switch (chain_.look(Eigen::AlignedBox2d(image[0].from, image[2].from))) {
    case Sight::None:
      return {};
    case Sight::All:
      return {image};
    case Sight::Some:
      break;
  }

  std::vector<Loop> shown = {image};
  if (!chain_.camera().lens().ideal()) {
    const Border lens = {.kind = Arc::Kind::LensEdge,
                         .inside = [&](const Arc& arc, double s) { return ray(arc, s) ? 1.0 : -1.0; },
                         .angle = [](const Eigen::Vector3d& r) { return std::atan2(r.y(), r.x()); },
                         .samples = 64,
                         .to_spare = 1e-9};
    shown = cut(image, lens, within_image(lens_edge(0)));
  }
  const Border ground = {.kind = Arc::Kind::Horizon,
                         .inside =
                             [&](const Arc& arc, double s) {
                               auto r = ray(arc, s);
                               if (!r) r = ray(arc, s + 1e-6 * (0.5 - s));  // where an arc ends at the lens's edge
                               return r ? ground_direction(*r).dot(axis_) - cos_edge_ : -1;
                             },
                         .angle =
                             [&](const Eigen::Vector3d& r) {
                               const Eigen::Vector3d u = ground_direction(r);
                               return std::atan2(u.dot(down_), u.dot(right_));
                             },
                         .smooth = true};
  bool horizon_within = within_image(towards_horizon(0));
  std::vector<Loop> seen;
  for (const Loop& loop : shown) {
    auto parts = cut(loop, ground, horizon_within);
    horizon_within = false;  // it is within one of them
    seen.insert(seen.end(), std::make_move_iterator(parts.begin()), std::make_move_iterator(parts.end()));
  }
  return seen;
}

}  // namespace nadir::render

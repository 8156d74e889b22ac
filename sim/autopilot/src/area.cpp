#include "nadir/sim/area.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>

namespace nadir::sim {
namespace {
using Eigen::Vector2d;
constexpr int disc_corners = 72;  // 1 / cos(pi / 72) = 1.00095

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double distance_m(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d edge = b - a;
  const double share = std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
  return (p - (a + share * edge)).norm();
}

/// Whether two segments have a point in common.
bool meet(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const double ca = cross(b - a, c - a), cb = cross(b - a, d - a), da = cross(d - c, a - c), db = cross(d - c, b - c);
  if (ca * cb < 0 && da * db < 0) return true;
  const double touch = 1e-9 * ((b - a).norm() + (d - c).norm());
  return std::min({distance_m(c, a, b), distance_m(d, a, b), distance_m(a, c, d), distance_m(b, c, d)}) <= touch;
}

}  // namespace

Result<Area> Area::polygon(std::vector<Vector2d> corners) {
  const std::size_t n = corners.size();
  if (n < 3) return fail(Error::Kind::Malformed, fmt::format("expected at least three corners, found {}", n));
  for (std::size_t i = 0; i < n; ++i) {
    if (!corners[i].allFinite())
      return fail(Error::Kind::Malformed, fmt::format("corner {}: a coordinate is not a finite number", i + 1));
    if ((corners[(i + 1) % n] - corners[i]).norm() < 1e-3)
      return fail(Error::Kind::Malformed, fmt::format("corners {} and {} are one", i + 1, (i + 1) % n + 1));
  }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = i + 1; k < n; ++k) {
      const auto &a = corners[i], &b = corners[i + 1], &c = corners[k], &d = corners[(k + 1) % n];
      // Neighbours share a corner, and no more than that: one folded back lies along the other
      const bool next = k == i + 1, before = (k + 1) % n == i;
      const bool bad = next     ? distance_m(d, a, b) < 1e-6 || distance_m(a, c, d) < 1e-6
                       : before ? distance_m(b, c, d) < 1e-6 || distance_m(c, a, b) < 1e-6
                                : meet(a, b, c, d);
      if (bad)
        return fail(Error::Kind::Malformed, fmt::format("the edges from corner {} and from corner {} cross or touch: "
                                                        "give the corners in their order around the area",
                                                        i + 1, k + 1));
    }
  Area area;
  area.corners_ = std::move(corners);
  return area;
}

Area Area::rectangle(const Vector2d& center, double length_m, double width_m, double heading_rad) {
  const Vector2d along = length_m / 2 * Vector2d(std::cos(heading_rad), std::sin(heading_rad)),
                 across = width_m / 2 * Vector2d(-std::sin(heading_rad), std::cos(heading_rad));
  Area area;
  area.corners_ = {center - along - across, center + along - across, center + along + across, center - along + across};
  return area;
}

Area Area::disc(const Vector2d& center, double radius_m) {
  Area area;
  area.center_ = center;
  area.radius_m_ = radius_m;
  for (int i = 0; i < disc_corners; ++i) {
    const double at = 2 * std::numbers::pi * i / disc_corners;
    area.corners_.emplace_back(center + radius_m / std::cos(std::numbers::pi / disc_corners) *
                                            Vector2d(std::cos(at), std::sin(at)));
  }
  return area;
}

bool Area::contains(const Vector2d& p, double margin_m) const {
  if (radius_m_ > 0) return (p - center_).norm() <= radius_m_ - margin_m;
  bool inside = false;
  for (std::size_t i = 0, n = corners_.size(); i < n; ++i) {
    const Vector2d &a = corners_[i], &b = corners_[(i + 1) % n];
    if (margin_m > 0 && distance_m(p, a, b) < margin_m) return false;
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
      inside = !inside;
  }
  return inside;
}

double Area::widest_m() const {
  if (radius_m_ > 0) return radius_m_;
  const auto edge_m = [&](const Vector2d& p) {
    double least_m = INFINITY;
    for (std::size_t i = 0, n = corners_.size(); i < n; ++i)
      least_m = std::min(least_m, distance_m(p, corners_[i], corners_[(i + 1) % n]));
    return contains(p) ? least_m : -least_m;
  };
  // Squares down to parts of them, those first that may hold the largest disc's middle, until none is left
  struct Square {
    Vector2d middle;
    double half_m = 0, most_m = 0;
    bool operator<(const Square& other) const { return most_m < other.most_m; }
  };
  double best_m = 0;
  std::priority_queue<Square> squares;
  const auto add = [&](const Vector2d& middle, double half_m) {
    const double here_m = edge_m(middle);
    best_m = std::max(best_m, here_m);
    squares.push({middle, half_m, here_m + std::numbers::sqrt2 * half_m});
  };
  const Eigen::AlignedBox2d box = bounds();
  const double half_m = box.sizes().maxCoeff() / 2;
  const double least_gain_m = 1e-6 * half_m;  // of areas that hardly have an inside
  add(box.center(), half_m);
  while (squares.top().most_m > best_m * 1.001 + least_gain_m) {
    const Square square = squares.top();
    squares.pop();
    for (const double n : {-0.5, 0.5})
      for (const double e : {-0.5, 0.5}) add(square.middle + square.half_m * Vector2d(n, e), square.half_m / 2);
  }
  return best_m;
}

Eigen::AlignedBox2d Area::bounds() const {
  Eigen::AlignedBox2d box;
  if (radius_m_ > 0) return {center_.array() - radius_m_, center_.array() + radius_m_};
  for (const Vector2d& corner : corners_) box.extend(corner);
  return box;
}

}  // namespace nadir::sim

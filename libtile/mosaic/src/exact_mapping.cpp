#include "exact_mapping.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace nadir::mosaic {
namespace {

geodesy::Projection around_its_middle(const Grid& grid) {
  geodesy::Projection projection = grid.projection;
  projection.wrap_around(center(grid).x());
  return projection;
}

/// Least and greatest x of a grid's outline, CRS units.
std::array<double, 2> range_x(const Grid& grid) {
  std::array<double, 2> range = {INFINITY, -INFINITY};
  for (const auto& corner : lattice(grid, 1)) {
    const double x = (grid.crs_from_texel * corner).x();
    range = {std::min(range[0], x), std::max(range[1], x)};
  }
  return range;
}

/// What brings x of the target to the turn of the source; none where they meet at several turns.
std::optional<double> turns_between(const Grid& target, const Grid& source) {
  const auto turn = target.projection.turn();
  if (!turn) return 0;
  const auto t = range_x(target), s = range_x(source);
  const double nearest = *turn * std::round((center(source).x() - center(target).x()) / *turn);
  const double slack = 1e-6 * (s[1] - s[0]);
  for (const double other : {nearest - *turn, nearest + *turn})
    if (t[0] + other < s[1] - slack && t[1] + other > s[0] + slack) return std::nullopt;
  return nearest;
}

void map_all(const Eigen::Affine2d& map, std::span<Eigen::Vector2d> points) {
  for (auto& p : points) p = map * p;
}

}  // namespace

bool same_crs(const geodesy::Projection& a, const geodesy::Projection& b) {
  geodesy::Projection first = a, second = b;
  first.wrap_around(0);
  second.wrap_around(0);
  return first == second;
}

Eigen::Vector2d center(const Grid& grid) {
  return grid.crs_from_texel *
         Eigen::Vector2d(static_cast<double>(grid.width) / 2, static_cast<double>(grid.height) / 2);
}

std::vector<Eigen::Vector2d> lattice(const Grid& grid, int sides) {
  std::vector<Eigen::Vector2d> points;
  for (int row = 0; row <= sides; ++row)
    for (int col = 0; col <= sides; ++col)
      points.emplace_back(static_cast<double>(grid.width) * col / sides,
                          static_cast<double>(grid.height) * row / sides);
  return points;
}

std::vector<Eigen::Vector2d> outline(const Grid& grid, int sides) {
  const double w = static_cast<double>(grid.width), h = static_cast<double>(grid.height);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < sides; ++i) {
    const double share = static_cast<double>(i) / sides;
    points.insert(points.end(), {{w * share, 0}, {w, h * share}, {w * (1 - share), h}, {0, h * (1 - share)}});
  }
  return points;
}

bool holds_pole(const Grid& grid, double lat_deg) {
  if (grid.projection.turn()) return false;  // there it is a line, on the outline at most
  const geodesy::Projection projection = around_its_middle(grid);
  std::array<Eigen::Vector2d, 1> pole = {Eigen::Vector2d(0, geodesy::to_radians(lat_deg))};
  projection.crs_from_lon_lat(pole);
  return contains(grid, grid.crs_from_texel.inverse() * pole[0]);
}

std::optional<Eigen::Vector2d> pole_in(const Grid& grid, double lat_deg) {
  const geodesy::Projection projection = around_its_middle(grid);
  const double lat = geodesy::to_radians(lat_deg);
  std::array<Eigen::Vector2d, 3> poles;
  for (std::size_t i = 0; i < poles.size(); ++i) poles[i] = {geodesy::to_radians(120.0 * static_cast<double>(i)), lat};
  projection.crs_from_lon_lat(poles);
  map_all(grid.crs_from_texel.inverse(), poles);
  const double apart = std::max((poles[1] - poles[0]).norm(), (poles[2] - poles[0]).norm());
  return apart < 1 ? std::optional(poles[0]) : std::nullopt;
}

bool contains(const Grid& grid, const Eigen::Vector2d& texel) {
  return texel.x() >= 0 && texel.y() >= 0 && texel.x() <= static_cast<double>(grid.width) &&
         texel.y() <= static_cast<double>(grid.height);
}

ExactMapping::ExactMapping(const Grid& target, const Grid& source)
    : target_(around_its_middle(target)),
      source_(around_its_middle(source)),
      target_crs_from_texel_(target.crs_from_texel),
      target_texel_from_crs_(target.crs_from_texel.inverse()),
      source_crs_from_texel_(source.crs_from_texel),
      source_texel_from_crs_(source.crs_from_texel.inverse()) {
  if (!same_crs(target.projection, source.projection)) return;
  if (const auto turns = turns_between(target, source)) {
    affine_ = source_texel_from_crs_ * Eigen::Translation2d(*turns, 0) * target_crs_from_texel_;
    inverse_ = affine_->inverse();
  }
}

void ExactMapping::source_from_target(std::span<Eigen::Vector2d> points) const {
  if (affine_) return map_all(*affine_, points);
  points_.fetch_add(static_cast<std::int64_t>(points.size()), std::memory_order_relaxed);
  map_all(target_crs_from_texel_, points);
  target_.lon_lat_from_crs(points);
  source_.crs_from_lon_lat(points);
  map_all(source_texel_from_crs_, points);
}

void ExactMapping::target_from_source(std::span<Eigen::Vector2d> points) const {
  if (affine_) return map_all(*inverse_, points);
  points_.fetch_add(static_cast<std::int64_t>(points.size()), std::memory_order_relaxed);
  map_all(source_crs_from_texel_, points);
  source_.lon_lat_from_crs(points);
  target_.crs_from_lon_lat(points);
  map_all(target_texel_from_crs_, points);
}

}  // namespace nadir::mosaic

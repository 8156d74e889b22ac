#include "grid_mapping.h"

#include <algorithm>
#include <limits>

namespace nadir::mosaic {
namespace {

constexpr std::int32_t patch_side = 128;  // texels; nine exact points for 16384 of them where no division is needed

}  // namespace

GridMapping::GridMapping(const Grid& target, const Grid& source, double tolerance_texels)
    : target_(target),
      source_(source),
      source_from_crs_(source.crs_from_texel.inverse()),
      target_from_crs_(target.crs_from_texel.inverse()),
      tolerance_(tolerance_texels * 2 / 3) {
  if (target.projection == source.projection) affine_ = source_from_crs_ * target.crs_from_texel;
}

void GridMapping::map(std::span<Eigen::Vector2d> points) const {
  exact_points_ += static_cast<std::int64_t>(points.size());
  for (Eigen::Vector2d& p : points) p = target_.crs_from_texel * p;
  if (!affine_) {
    target_.projection.lon_lat_from_crs(points);
    source_.projection.crs_from_lon_lat(points);
  }
  for (Eigen::Vector2d& p : points) p = source_from_crs_ * p;
}

void GridMapping::map_back(std::span<Eigen::Vector2d> points) const {
  for (Eigen::Vector2d& p : points) p = source_.crs_from_texel * p;
  if (!affine_) {
    source_.projection.lon_lat_from_crs(points);
    target_.projection.crs_from_lon_lat(points);
  }
  for (Eigen::Vector2d& p : points) p = target_from_crs_ * p;
}

std::vector<MappingPatch> GridMapping::patches(const Window& window) const {
  std::vector<MappingPatch> done;
  const std::int64_t left = window.x / patch_side * patch_side, top = window.y / patch_side * patch_side;
  // Corners of all squares at once: a library is asked in bulk.
  const std::int64_t columns = (window.x + window.width - left - 1) / patch_side + 1;
  const std::int64_t rows = (window.y + window.height - top - 1) / patch_side + 1;
  std::vector<Eigen::Vector2d> corners;
  corners.reserve(static_cast<std::size_t>((columns + 1) * (rows + 1)));
  for (std::int64_t row = 0; row <= rows; ++row)
    for (std::int64_t col = 0; col <= columns; ++col)
      corners.emplace_back(static_cast<double>(left + col * patch_side), static_cast<double>(top + row * patch_side));
  map(corners);
  for (std::int64_t row = 0; row < rows; ++row) {
    for (std::int64_t col = 0; col < columns; ++col) {
      const auto at = static_cast<std::size_t>(row * (columns + 1) + col),
                 below = at + static_cast<std::size_t>(columns) + 1;
      divide({left + col * patch_side,
              top + row * patch_side,
              patch_side,
              {corners[at], corners[at + 1], corners[below], corners[below + 1]}},
             done);
    }
  }
  return done;
}

void GridMapping::divide(const MappingPatch& patch, std::vector<MappingPatch>& done) const {
  if (affine_ || patch.side == 1) {
    done.push_back(patch);
    return;
  }
  const double half = patch.side / 2.0, x = static_cast<double>(patch.x), y = static_cast<double>(patch.y);
  std::array<Eigen::Vector2d, 5> exact = {
      Eigen::Vector2d(x + half, y), Eigen::Vector2d(x, y + half), Eigen::Vector2d(x + half, y + half),
      Eigen::Vector2d(x + patch.side, y + half), Eigen::Vector2d(x + half, y + patch.side)};
  map(exact);
  const auto& [a, b, c, d] = patch.corners;
  const std::array<Eigen::Vector2d, 5> between = {(a + b) / 2, (a + c) / 2, (a + b + c + d) / 4, (b + d) / 2,
                                                  (c + d) / 2};
  bool near = true;
  for (std::size_t i = 0; i < exact.size(); ++i) near &= (exact[i] - between[i]).norm() <= tolerance_;  // false of NaN
  const bool nowhere = !patch.defined() && std::none_of(exact.begin(), exact.end(), [](const auto& p) {
    return p.allFinite();
  }) && std::none_of(patch.corners.begin(), patch.corners.end(), [](const auto& p) { return p.allFinite(); });
  if (near || nowhere) {
    done.push_back(patch);
    return;
  }
  const std::int32_t side = patch.side / 2;
  divide({patch.x, patch.y, side, {a, exact[0], exact[1], exact[2]}}, done);
  divide({patch.x + side, patch.y, side, {exact[0], b, exact[2], exact[3]}}, done);
  divide({patch.x, patch.y + side, side, {exact[1], exact[2], c, exact[4]}}, done);
  divide({patch.x + side, patch.y + side, side, {exact[2], exact[3], exact[4], d}}, done);
}

}  // namespace nadir::mosaic

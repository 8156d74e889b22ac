#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "nadir/mosaic/grid.h"

namespace nadir::mosaic {

/// Whether coordinates in `a` are coordinates in `b`, but for whole turns of longitude.
bool same_crs(const geodesy::Projection& a, const geodesy::Projection& b);

/// The middle of the raster in CRS units.
Eigen::Vector2d center(const Grid& grid);

/// Points of `grid` in texels, `sides + 1` along each axis, corners included.
std::vector<Eigen::Vector2d> lattice(const Grid& grid, int sides);

/// Points along the outline of `grid` in texels, `sides` from each corner to the next.
std::vector<Eigen::Vector2d> outline(const Grid& grid, int sides);

/// Whether the pole at `lat_deg`, -90 or 90, lies within the raster.
bool holds_pole(const Grid& grid, double lat_deg);

/// Where that pole lies in texels, if it is one place there and not a line or beyond all numbers.
std::optional<Eigen::Vector2d> pole_in(const Grid& grid, double lat_deg);

/// Whether `texel` lies within the raster's outline; NaN does not.
bool contains(const Grid& grid, const Eigen::Vector2d& texel);

/// Texels of one grid to texels of another, point by point: by an affine map where both share a CRS, else through
/// WGS-84 longitude and latitude. Thread-safe.
class ExactMapping {
 public:
  ExactMapping(const Grid& target, const Grid& source);

  /// Source texels from target texels, where the grids share a CRS and meet at one turn of longitude at most.
  const std::optional<Eigen::Affine2d>& affine() const { return affine_; }

  /// In place. What is not defined on the way becomes NaN.
  void source_from_target(std::span<Eigen::Vector2d> points) const;
  void target_from_source(std::span<Eigen::Vector2d> points) const;

  /// Points that were mapped so far, both ways, affine ones left out.
  std::int64_t points() const { return points_.load(std::memory_order_relaxed); }

 private:
  geodesy::Projection target_, source_;  // longitudes around the grid's own middle
  Eigen::Affine2d target_crs_from_texel_, target_texel_from_crs_, source_crs_from_texel_, source_texel_from_crs_;
  std::optional<Eigen::Affine2d> affine_, inverse_;
  mutable std::atomic<std::int64_t> points_{0};
};

}  // namespace nadir::mosaic

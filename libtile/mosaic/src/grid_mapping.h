#pragma once

#include <array>
#include <atomic>
#include <vector>

#include "nadir/mosaic/block.h"
#include "nadir/mosaic/grid.h"

namespace nadir::mosaic {

/// A square of target texels within which source coordinates are bilinear between its corners.
struct MappingPatch {
  std::int64_t x = 0, y = 0;
  std::int32_t side = 0;
  std::array<Eigen::Vector2d, 4> corners;  // source texels, row by row; NaN where the mapping is not defined

  bool defined() const {
    return corners[0].allFinite() && corners[1].allFinite() && corners[2].allFinite() && corners[3].allFinite();
  }
};

/// From texels of one grid to those of another, within a bound.
///
/// Where both share a CRS it is affine and exact. Else squares of the target, always the same ones whatever is asked
/// for, are halved until bilinear interpolation of their corners is near enough. For a mapping whose second derivatives
/// are constant over a square its error is greatest at the centre or in the middle of a side, where it is checked; a
/// third of the tolerance is left for what they change.
/// Thread-safe.
class GridMapping {
 public:
  GridMapping(const Grid& target, const Grid& source, double tolerance_texels);

  /// Source texels from target texels, in place, exact; NaN where undefined.
  void map(std::span<Eigen::Vector2d> points) const;
  /// The way back.
  void map_back(std::span<Eigen::Vector2d> points) const;

  bool is_affine() const { return affine_.has_value(); }
  const Eigen::Affine2d& affine() const { return *affine_; }

  /// Patches that hold all texels of `window`, clipped to nothing: they may reach beyond it.
  std::vector<MappingPatch> patches(const Window& window) const;

  std::int64_t exact_points() const { return exact_points_; }

 private:
  void divide(const MappingPatch& patch, std::vector<MappingPatch>& done) const;

  Grid target_, source_;
  Eigen::Affine2d source_from_crs_, target_from_crs_;
  std::optional<Eigen::Affine2d> affine_;
  double tolerance_;
  mutable std::atomic<std::int64_t> exact_points_{0};
};

}  // namespace nadir::mosaic

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <span>

#include "nadir/tile/map_description.h"

namespace nadir::render {

/// Binary logarithm in basic arithmetic, so that every CPU picks the same levels, which libm does not promise.
/// `x`: positive, normal. Error: under 2e-7.
double log2_portable(double x);

/// Coordinate in a map's levels whose texels are `texels` level-0 texels a side: 0 at full resolution, 1.5 half-way (in
/// the logarithm) between levels 1 and 2, at most the coarsest. `texels`: positive.
/// Source: Williams, Pyramidal Parametrics, 1983, for any sizes of levels.
double level_coordinate(std::span<const tile::Level> levels, double texels);

/// How two levels share what lies between them.
struct LevelBlend {
  /// Part of the way from one level to the next in which both are blended, around the half-way point: 1 blends
  /// everywhere, 0 takes the nearer level.
  double band = 1;

  struct Choice {
    int finer = 0;       // level
    double coarser = 0;  // share of the level after it, less than 1
  };
  /// For a level coordinate of 0 or more.
  Choice operator()(double coordinate) const {
    const int level = static_cast<int>(coordinate);
    const double from_half = coordinate - level - 0.5;
    if (band == 0) return {level + (from_half >= 0), 0};
    const double share = std::max(from_half / band + 0.5, 0.0);
    return share < 1 ? Choice{level, share} : Choice{level + 1, 0};
  }
};

/// How a pixel's footprint is averaged: a grid of bilinear samples, each from the level whose texels it spans.
struct SamplePattern {
  double texels = 1;                    // side of what one sample stands for, level-0 texels
  double samples_x = 1, samples_y = 1;  // wanted across the pixel's width and height, before rounding
};

/// `jacobian`: its columns are the steps on level 0, in texels, for a pixel's width and height; its singular values are
/// the footprint's axes. Each sample stands for the shorter one divided by `oversampling`, or for 1/`most_samples` of
/// the longer, whichever is more, but for no more than a texel of the coarsest level. Continuous in the Jacobian, so
/// that levels show no seam.
SamplePattern footprint_samples(const Eigen::Matrix2d& jacobian, double oversampling, int most_samples,
                                double coarsest_texels);

/// The footprint's longer axis, level-0 texels.
double longer_axis(const Eigen::Matrix2d& jacobian);

/// Geometric mean of the footprint's axes, for one sample a pixel.
double footprint_side(const Eigen::Matrix2d& jacobian);

}  // namespace nadir::render

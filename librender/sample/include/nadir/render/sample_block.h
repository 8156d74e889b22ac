#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "nadir/render/biquadratic.h"
#include "nadir/render/level_of_detail.h"
#include "nadir/tile/cell_source.h"

namespace nadir::render {

/// How a sample is made of texels.
enum class Interpolation {
  Nearest,   // the texel that holds it
  Bilinear,  // of the four around it
  Cubic,     // Keys' convolution of the sixteen around it
};

/// The pinned cells of one level that a block of pixels may sample: cols by rows of them, rows from the top.
struct LevelWindow {
  int level = 0;
  double texels_x = 1, texels_y = 1;   // level-0 texels to one of this level's
  std::int32_t width = 0, height = 0;  // of the level, texels
  std::int32_t first_col = 0, first_row = 0, cols = 0, rows = 0;
  // A block lies across the two ends of a map that goes around the Earth: columns of texels, and of cells, are counted
  // on past the level's width, and `cells` are those of the stored columns `columns`.
  bool around = false;
  std::span<const std::int32_t> columns;
  std::span<const tile::Cell* const> cells;
};

/// A block of pixels and how each is sampled from one source: all that a kernel needs, resolved beforehand.
struct BlockSampling {
  int width = 0, height = 0;  // pixels

  // Level-0 texel of an image point: texel_origin + apply(texel_from_image, point - block's corner), ...
  Eigen::Matrix3d texel_from_image = Eigen::Matrix3d::Identity();
  Eigen::Vector2d texel_origin = Eigen::Vector2d::Zero();
  // ... or texel_origin + biquadratic(point - block's corner), ...
  std::optional<Biquadratic> biquadratic;
  // ... or, where this is not empty, given for each pixel centre, NaN where no ground is seen, with one Jacobian for
  // all.
  std::span<const Eigen::Vector2d> texels;
  Eigen::Matrix2d jacobian = Eigen::Matrix2d::Zero();

  std::array<double, 4> level_at_corner{};  // top left, top right, bottom right, bottom left; between them bilinear
  LevelBlend level_blend;                   // which levels that means
  int samples_x = 1, samples_y = 1;         // a grid of samples within each pixel
  Interpolation interpolation = Interpolation::Bilinear;

  double map_width = 0, map_height = 0;  // level-0 texels
  bool inside = false;                   // every pixel centre lies on the map
  std::span<const LevelWindow> levels;   // consecutive, from the finest
};

/// What a block is sampled into, and from what: the block's first sample and validity byte in frames of one pixel's
/// samples after the other, and windows like the block's, but for their cells.
struct BlockTarget {
  std::span<const LevelWindow> levels;
  void* samples = nullptr;
  std::uint8_t* validity = nullptr;
};

/// Samples a block, with the fastest kernels that this CPU has; all give the same bytes.
///
/// Each pixel is the mean of its samples, of which each is blended linearly between two levels where LevelBlend says
/// so. Invalid texels take no part; a pixel is valid where valid texels carry at least half of its weight and its
/// centre is on the map. An invalid pixel's samples are 0. Samples are of the source's type, bands interleaved, in
/// frames of `stride_px` pixels a row; validity is one byte a pixel, 1 or 0.
///
/// Sources of one type and one number of bands on one grid are sampled together, each as `source` is: where samples lie
/// is found once for all `targets`. Each gets the bytes that it would get alone.
///
/// Integers are rounded to nearest, ties up, and held within their type's range, which Cubic may leave. Error before
/// that, against samples in exact arithmetic: of bytes, Bilinear, 0.016 for a sample of one level (fractions of 15 bits
/// and sums in units of 1/128; with levels blended 0.028); of all else what single precision leaves, under 1e-6 of the
/// greatest texel. Where samples lie is off by 2.3e-5 texels of their level at most.
void sample_block(const BlockSampling& block, const tile::CellSource& source, std::span<const BlockTarget> targets,
                  std::size_t stride_px);

}  // namespace nadir::render

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "nadir/render/biquadratic.h"
#include "nadir/tile/cell_source.h"

namespace nadir::render {

/// The pinned cells of one level that a block of pixels may sample: cols by rows of them, rows from the top.
struct LevelWindow {
  int level = 0;
  double texels_x = 1, texels_y = 1;  // level-0 texels to one of this level's
  std::int32_t first_col = 0, first_row = 0, cols = 0, rows = 0;
  // Where a block lies across the two ends of a map that goes around the Earth: the level's width. Columns are counted
  // on past it then, and a cell of them holds texels of both ends.
  std::int32_t around = 0;
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
  int samples_x = 1, samples_y = 1;         // a grid of bilinear samples within each pixel
  bool nearest = false;  // the texel that holds the pixel's centre, at the level nearest to the coordinate

  double map_width = 0, map_height = 0;  // level-0 texels
  bool inside = false;                   // every pixel centre lies on the map
  std::span<const LevelWindow> levels;   // consecutive, from the finest
  bool masked = false;                   // some cell in them has an invalid texel
};

/// Samples a block, the definition in plain arithmetic.
///
/// Each pixel is the mean of its samples; each sample is bilinear in the two levels around the level coordinate,
/// blended linearly. Invalid texels take no part; a pixel is valid where valid texels carry at least half of its weight
/// and its centre is on the map. An invalid pixel's samples are 0. `out`: the block's first sample in a frame of
/// `stride_px` pixels a row, bands interleaved, of the source's type; `validity`: likewise, one byte a pixel, 1 or 0.
/// Integers are rounded to nearest, ties up.
void sample_block(const BlockSampling& block, const tile::CellSource& source, void* out, std::uint8_t* validity,
                  std::size_t stride_px);

}  // namespace nadir::render

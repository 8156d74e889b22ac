#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "mosaic.h"
#include "nadir/gdal/dataset.h"
#include "nadir/pyramid/build.h"
#include "scratch.h"

namespace nadir::pyramid {

/// Samples of a finer level that one coarser sample covers along one axis, and how much of each.
struct Cover {
  int first = 0, count = 0;
  std::array<int, 3> parts = {};  // of a sample's width, in units of 1 / (size of the coarser level)
};

/// Covers of all samples of a coarser level of size ceil(fine / 2). Both levels span the same ground, so that an
/// odd size gives fractions: what lies at the far edge stays there.
std::vector<Cover> covers(int fine, int coarse);

/// Mean by area of `values`; `weights` > 0, at least one.
double mean(std::span<const double> values, std::span<const double> weights);

/// 10 log10 of the mean of the powers of ten that `decibels` stand for. Relative to the greatest of them, so that
/// no value overflows or vanishes, and equal values give exactly that value.
double mean_of_power(std::span<const double> decibels, std::span<const double> weights);

enum class Mean { AsStored, Power };

/// Levels go on until both axes have at most so many texels, even where one tile would hold more: what is seen
/// from far above needs a level as coarse as its pixels, and these cost next to nothing.
constexpr int coarsest_texels = 64;

/// Sizes of the coarser levels, each half of the one before, rounded up.
std::vector<LevelSize> level_sizes(int width, int height);

/// Reduces `full`, the mosaic, to all its coarser levels, each from the one before, as files in `scratch`.
/// A sample that is invalid or not finite has no part in a mean; where none has, nodata is written, NaN where the
/// type can and no nodata is set, else 0. Integers are rounded to nearest, and never onto nodata.
/// Error: half a step of the sample type a level.
Result<std::vector<std::filesystem::path>> reduce(GDALDataset& full, const Mosaic& mosaic, Mean kind, int tile_size,
                                                  const Scratch& scratch, bool show_progress);

}  // namespace nadir::pyramid

#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/geodesy/projection.h"

namespace nadir::mosaic {

/// Where the texels of a raster lie: column and row from the outer corner of the first, in a CRS.
struct Grid {
  geodesy::Projection projection;
  std::string definition;              // of the CRS: "EPSG:32614", or WKT2
  Eigen::Affine2d crs_from_texel;      // may be rotated
  std::int64_t width = 0, height = 0;  // texels
};

/// What a user says of the grid of a map in the making; what is left out comes from the sources.
struct GridOptions {
  std::string crs;                              // what PROJ knows; else that of the first source
  std::optional<double> gsd;                    // side of a texel, units of the CRS; else the finest among the sources
  std::optional<std::array<double, 4>> extent;  // left, bottom, right, top, units of the CRS; else around all sources
};

/// The grid that holds all of `sources`: that of the first, enlarged, where no option says otherwise, so that sources
/// on it are not resampled; with a `gsd` aligned to whole multiples of it.
/// Unsupported, naming source (by `labels`) and place, where a source's outline is not defined in the CRS or where the
/// grid has more than 2^31 - 1 texels a side.
Result<Grid> common_grid(std::span<const Grid> sources, std::span<const std::string> labels,
                         const GridOptions& options);

}  // namespace nadir::mosaic

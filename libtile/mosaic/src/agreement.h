#pragma once

#include <span>
#include <vector>

#include "nadir/mosaic/source.h"
#include "raster_header.h"
#include "readers.h"

namespace nadir::mosaic {

/// What a map is that takes all of some rasters, and how each is read for it.
struct Agreement {
  Sources map;  // but for the rasters
  std::vector<Reading> readings;
};

/// Errors name the raster that cannot go with the first, and what to do.
Result<Agreement> agree(std::span<const RasterHeader> headers, const SourceOptions& options);

}  // namespace nadir::mosaic

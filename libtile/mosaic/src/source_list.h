#pragma once

#include <vector>

#include "nadir/mosaic/source.h"
#include "raster_header.h"

namespace nadir::mosaic {

/// The rasters that names mean, in their order, those of a folder by name.
/// NotFound or Malformed, naming it, where one means none.
Result<std::vector<NamedRaster>> list_sources(const SourceOptions& options);

}  // namespace nadir::mosaic

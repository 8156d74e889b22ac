#pragma once

#include <memory>

#include "nadir/base/byte_source.h"
#include "nadir/tile/raster.h"

namespace nadir::tile {

/// A tiled TIFF whose tiles are decoded here; what its headers leave open is asked of GDAL where it is a file on disk.
/// Unsupported where it is another raster.
Result<std::unique_ptr<Raster>> open_tiff_raster(std::shared_ptr<const ByteSource> source);

}  // namespace nadir::tile

#pragma once

#include <memory>

#include "nadir/base/byte_source.h"
#include "nadir/tile/raster.h"

namespace nadir::tile {

/// A tiled TIFF whose tiles are decoded here. What its headers leave open is asked of GDAL, which knows the file as
/// `gdal_name`; empty where it does not. Unsupported where it is another raster.
Result<std::unique_ptr<Raster>> open_tiff_raster(std::shared_ptr<const ByteSource> source,
                                                 const std::string& gdal_name);

}  // namespace nadir::tile

#pragma once

#include "nadir/tile/raster.h"

namespace nadir::gdal {

// What RasterModule promises.
Result<tile::MapDescription> describe_by_gdal(const std::string& path);
Result<std::unique_ptr<tile::Raster>> open_gdal_raster(const std::string& path);
void limit_block_cache(std::uint64_t bytes);

}  // namespace nadir::gdal

#pragma once

#include <gdal_priv.h>

#include <vector>

#include "nadir/tile/map_description.h"

namespace nadir::gdal {

/// `overview_of_level`: for each level from 1 on, which of GDAL's overviews it is.
tile::MapDescription describe_dataset(GDALDataset& dataset, const std::string& path,
                                      std::vector<int>& overview_of_level);

}  // namespace nadir::gdal

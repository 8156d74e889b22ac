#pragma once

#include <gdal_priv.h>

#include <vector>

#include "nadir/tile/map_description.h"

namespace nadir::tile {

/// `overview_of_level`: for each level from 1 on, which of GDAL's overviews it is.
MapDescription describe_dataset(GDALDataset& dataset, const std::string& path, std::vector<int>& overview_of_level);

}  // namespace nadir::tile

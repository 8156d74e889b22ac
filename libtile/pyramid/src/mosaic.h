#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "nadir/gdal/dataset.h"
#include "source.h"

namespace nadir::pyramid {

/// Sources laid onto the grid of the first, later ones on top: what level 0 of the map will be.
struct Mosaic {
  std::vector<Source> sources;
  std::vector<std::pair<int, int>> corners;  // column and row of each source's first texel
  int width = 0, height = 0;
  int band_count = 0;
  bool mask = false;  // validity lies in a mask band of its own
  std::vector<std::pair<std::string, std::string>> metadata;
  std::vector<std::string> warnings;
};

/// `alpha_to_mask`: for codecs that store colours only.
Result<Mosaic> lay_out(std::vector<Source> sources, bool alpha_to_mask);

/// The mosaic as a GDAL virtual raster, to be read by one thread. Its overviews are `levels`: rasters with the
/// mosaic's bands, and with its mask band where it has one.
Result<gdal::Dataset> open_mosaic(const Mosaic& mosaic, std::span<const std::filesystem::path> levels);

}  // namespace nadir::pyramid

#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "nadir/base/result.h"

namespace nadir::mosaic {

/// Whether a folder holds map tiles DIR/{zoom}/{x}/{y}.png.
bool holds_tiles(const std::filesystem::path& folder);

/// A GDAL virtual raster (XML) of four bands, red, green, blue and alpha, over one zoom of an XYZ tile folder.
/// Tiles may be grey, coloured or palettes, with alpha or without; alpha is 255 where a tile has none, 0 where
/// no tile is.
Result<std::string> virtual_raster_of_tiles(const std::filesystem::path& folder, std::optional<int> zoom);

}  // namespace nadir::mosaic

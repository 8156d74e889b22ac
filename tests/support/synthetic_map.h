#pragma once

#include <gdal.h>

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace nadir::test {

/// A raster whose right pictures are known, because its texels follow a rule.
struct SyntheticMap {
  int width = 256, height = 256, bands = 1;
  GDALDataType type = GDT_Float32;
  std::string crs = "EPSG:4326";                             // none where empty
  std::array<double, 6> geotransform = {0, 1, 0, 0, 0, -1};  // GDAL's: x of (0,0), per column, per row, y of (0,0), ...
  std::vector<std::array<double, 4>> control_points;         // texel x, y and place x, y; instead of a geotransform
  std::optional<double> nodata;
  std::vector<int> factors;  // of overviews
  int tile = 128;
  bool pixel_is_point = false;  // told so by the file, which then holds the place of the first texel's centre
  bool mask = false;            // a mask band, valid where mask_value is not 0
  bool alpha = false;           // the last band is alpha
  std::string role;             // as nadir build writes it

  /// Value of a texel: level, band from 0, column, row. Overviews get their own, not an average.
  std::function<double(int level, int band, int col, int row)> value;
  std::function<double(int col, int row)> mask_value;
};

/// Writes it as tiled GeoTIFF.
void write_map(const SyntheticMap& map, const std::string& path);

}  // namespace nadir::test

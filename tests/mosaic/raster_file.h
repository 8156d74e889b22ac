#pragma once

#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nadir/mosaic/source.h"

namespace nadir::mosaic {

/// A raster file for a test, written by GDAL.
struct RasterFile {
  int width = 70, height = 50, bands = 1;
  GDALDataType type = GDT_Byte;
  std::string driver = "GTiff";
  std::vector<std::string> options;  // of its creation
  std::string crs = "EPSG:32614";
  std::array<double, 6> place = {500000, 1, 0, 5000000, 0, -1};  // GDAL's geotransform; none where the CRS is empty
  std::vector<std::optional<double>> nodata;                     // of each band; empty: none
  std::vector<GDALColorInterp> colors;
  std::vector<std::string> names;
  std::vector<std::array<short, 4>> palette;
  std::map<std::string, std::string> metadata;
  bool mask = false, external_mask = false;  // invalid where (x / 8 + y / 4) % 3 == 0
  bool unwritten = false;                    // sparse: only the headers
  std::function<double(int band, int x, int y)> value = [](int band, int x, int y) {
    return (x * 7 + y * 13 + band * 31 + (x * y) % 11) % 120;
  };
};

/// Throws where GDAL cannot.
void write(const RasterFile& file, const std::string& path);

/// A window as GDAL reads it: for each texel its bands (numbers from 1) as doubles, and its mask, 255 or 0.
struct GdalTexels {
  std::vector<double> samples;
  std::vector<std::uint8_t> valid;
};
GdalTexels read_by_gdal(const std::string& path, const Window& window, const std::vector<int>& bands);

/// Samples of a block as doubles, in its order.
std::vector<double> samples_of(const Block& block, const TexelType& type);
std::vector<std::uint8_t> validity_of(const Block& block);

/// Whether all are the same; NaN is the same as NaN.
testing::AssertionResult same_samples(const std::vector<double>& a, const std::vector<double>& b);

/// Windows of a raster that ask for all of it and for parts that no tile ends with.
std::vector<Window> windows_of(std::int64_t width, std::int64_t height);

}  // namespace nadir::mosaic

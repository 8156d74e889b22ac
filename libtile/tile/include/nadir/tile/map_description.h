#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/tile/sample_type.h"

namespace nadir::tile {

/// One resolution of a map. Level 0 is full resolution; sizes come from the file.
/// A level-k texel coordinate is the level-0 coordinate divided by texels_x, texels_y.
struct Level {
  std::int32_t width = 0, height = 0;            // texels
  double texels_x = 1, texels_y = 1;             // level-0 texels to one of this level's: size_0 / size_k
  std::int32_t tile_width = 0, tile_height = 0;  // block as stored, texels
};

struct Band {
  std::string name;                       // description, or empty
  std::string stored_type;                // as GDAL names it: "Float64"
  std::optional<SampleType> sample_type;  // how it is read; empty where it cannot be: complex, signed bytes
  std::optional<double> nodata;
  std::string color;  // colour interpretation: "Red", "Alpha", "Palette"
  std::string unit;
  double scale = 1, offset = 0;  // physical value = stored value * scale + offset; frames hold stored values

  /// "has type CFloat32, ..." and what to do about it, for a message; of a band without sample_type.
  std::string why_not_rendered() const;
};

/// What says that a texel holds no data.
enum class ValiditySource { None, Nodata, Mask, Alpha };

struct Georeference {
  std::string crs;                 // "EPSG:32614", or the CRS's name
  std::string definition;          // what says it all: "EPSG:32614", or WKT2
  Eigen::Affine2d crs_from_texel;  // texel (0, 0) is the outer corner of the first one
};

/// All that `nadir info` tells: read from a raster's headers, no pixel decoded.
struct MapDescription {
  std::string path;
  std::string format;       // GDAL's driver: "GTiff"
  std::string layout;       // "COG" where the file says so
  std::string compression;  // "DEFLATE"; empty where none
  std::vector<Level> levels;
  std::vector<Band> bands;
  ValiditySource validity = ValiditySource::None;
  std::optional<Georeference> georeference;
  std::string georeference_problem;  // why the former is empty
  std::string acquired, attribution, licence, role;
  std::vector<std::string> warnings;  // what a user should know before rendering from it

  /// Bands that carry imagery: all but alpha. Numbers from 1, as GDAL counts.
  std::vector<int> data_bands() const;
  /// Number of the band that `name` means: a number, or a description such as "VV".
  Result<int> find_band(const std::string& name) const;
};

/// Describes any raster GDAL opens, georeferenced or not.
Result<MapDescription> describe(const std::string& path);

}  // namespace nadir::tile

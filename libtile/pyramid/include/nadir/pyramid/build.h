#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/tile/role.h"

namespace nadir::pyramid {

/// Jpeg always loses; Webp does below quality 100, Lerc above a largest error of 0. The others never do.
enum class Compression { None, Deflate, Zstd, Lzw, Jpeg, Webp, Lerc };
std::string_view to_string(Compression compression);  // "zstd"
Result<Compression> parse_compression(std::string_view name);

/// How a level's texels come from those of the level before that lie under or near them.
enum class Filter : std::uint8_t { Box, Gaussian, Lanczos, Nearest, Mode };
std::string_view to_string(Filter filter);  // "box"
Result<Filter> parse_filter(std::string_view name);

struct BuildOptions {
  /// Rasters, or folders of XYZ tiles: DIR/{zoom}/{x}/{y}.png, Web-Mercator, y downward. Several become one
  /// mosaic on the grid of the first, later ones on top; they agree in CRS, texel size, bands and sample type.
  std::vector<std::string> sources;
  std::filesystem::path output;  // missing folders are made
  bool force = false;            // replace an output that is there

  std::vector<std::string> bands;               // names, or numbers from 1; empty: all. Alpha always stays.
  std::optional<tile::Role> role;               // else the source's own, else averaged as optical imagery is
  std::optional<tile::RadarScale> radar_scale;  // else Decibel for floating-point radar, Linear for other
  std::optional<int> zoom;                      // of XYZ folders; else the deepest there

  Compression compression = Compression::Zstd;
  std::optional<int> quality;  // Jpeg and Webp, 1 to 100, else 90; Webp is lossless at 100
  double max_error = 0;        // Lerc, in stored units, >= 0
  int tile_size = 512;         // texels, a multiple of 16 from 128 to 4096

  /// What is empty stays as the sources have it, where they agree.
  std::string acquired;  // ISO 8601: 2014-07-20, or 2014-07-20T17:05:00Z
  std::string attribution, licence;

  int threads = 0;  // that compress; 0: one a core
  std::uint64_t memory_bytes =
      512 << 20;  // for GDAL's blocks, in the whole process; a GDAL_CACHEMAX set by the user wins
  bool show_progress = true;
};

struct LevelSize {
  std::int32_t width = 0, height = 0;
};

struct BuildReport {
  std::filesystem::path output;
  std::vector<LevelSize> levels;  // from full resolution on
  int bands = 0;                  // alpha included
  std::string sample_type;        // as GDAL names it: "Float32"
  std::string reduction;          // how a level comes from the one before: "mean", "mean of power", "mode"
  std::uint64_t raw_bytes = 0;    // samples of all levels
  std::uint64_t file_bytes = 0;
  double seconds = 0;
  std::vector<std::string> warnings;  // what a user should know of this map
};

/// Writes a cloud-optimized GeoTIFF with all its levels.
///
/// Names, nodata, scale, offset, units, colours and metadata of the bands are kept. Reduction leaves out what
/// is invalid (nodata, mask, alpha, NaN); radar in dB is averaged in power, labels take their most frequent value.
/// `output` appears whole or not at all; beside it lies a folder of temporary files while this runs, with up to
/// two thirds of the uncompressed size of level 0. GDAL prints nothing meanwhile, on any thread.
Result<BuildReport> build(const BuildOptions& options);

}  // namespace nadir::pyramid

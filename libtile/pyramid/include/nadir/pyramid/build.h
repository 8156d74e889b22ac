#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/mosaic/grid.h"
#include "nadir/mosaic/placement.h"
#include "nadir/mosaic/source.h"
#include "nadir/tiff/directory.h"
#include "nadir/tile/role.h"

namespace nadir::pyramid {

/// Jpeg always loses; Webp does below quality 100, Lerc above a largest error of 0. The others never do.
enum class Compression : std::uint8_t { None, Deflate, Zstd, Lzw, Lzma, Jpeg, Webp, Lerc };
std::string_view to_string(Compression compression);  // "zstd"
Result<Compression> parse_compression(std::string_view name);

/// How a level's texels come from those of the level before that lie under or near them.
enum class Filter : std::uint8_t { Box, Gaussian, Lanczos, Nearest, Mode };
std::string_view to_string(Filter filter);  // "box"
Result<Filter> parse_filter(std::string_view name);

/// One of several processes that share a build: it packs its part of the map, and `join` brings them together.
struct Shard {
  int number = 1, count = 1;  // number from 1 to count
};

struct BuildOptions {
  std::vector<std::string> sources;  // as mosaic::SourceOptions::names has them
  std::filesystem::path output;      // missing folders are made
  bool force = false;                // replace an output that is there

  std::vector<std::string> bands;               // names, or numbers from 1; empty: all. Alpha always stays.
  std::optional<tile::Role> role;               // else the source's own, else averaged as optical imagery is
  std::optional<tile::RadarScale> radar_scale;  // else Decibel for floating-point radar, Linear for other
  std::optional<int> zoom;                      // of XYZ folders; else the deepest there
  mosaic::Overlap overlap = mosaic::Overlap::Last;
  mosaic::GridOptions grid;
  std::optional<mosaic::Interpolation> interpolation;  // where texels must move; else nearest for labels, bilinear
  double tolerance_texels = 0.05;                      // of where they move to, in texels of the source

  std::optional<Filter> filter;  // else mode for labels and palettes, box for radar, lanczos
  Compression compression = Compression::Zstd;
  std::optional<int> level;                  // of the codec; else its usual one
  std::optional<tiff::Predictor> predictor;  // else what suits the samples
  std::optional<int> quality;                // Jpeg and Webp, 1 to 100, else 90; Webp is lossless at 100
  bool subsample_chroma = true;              // Jpeg of colours
  double max_error = 0;                      // Lerc, in stored units, >= 0
  int tile_size = 512;                       // texels, a multiple of 16 from 128 to 1024

  /// What is empty stays as the sources have it, where they agree.
  std::string acquired;  // ISO 8601: 2014-07-20, or 2014-07-20T17:05:00Z
  std::string attribution, licence;

  std::optional<Shard> shard;  // make this part only
  int join = 0;                // bring so many shards together, and make what lies above them; 0: there are none
  bool explain = false;        // say how it would be done, and do nothing

  int threads = 0;  // 0: one a core
  std::uint64_t memory_bytes = 512 << 20;
  bool show_progress = true;
};

struct LevelSize {
  std::int32_t width = 0, height = 0;
};

struct BuildReport {
  std::filesystem::path output;   // of a shard: the folder that holds it
  std::vector<LevelSize> levels;  // from full resolution on
  int bands = 0;                  // alpha included
  std::string sample_type;        // "float32"
  std::string reduction;          // how a level comes from the one before: "box", "box of power", "mode"
  std::uint64_t raw_bytes = 0;    // samples of all levels
  std::uint64_t file_bytes = 0;
  std::int64_t tiles = 0, empty_tiles = 0;  // of all levels; of them, those that hold nothing and take no room
  std::int64_t kept_chunks = 0;             // done by an earlier run, and not made again
  std::int64_t source_blocks = 0;           // that the sources are stored in, where they must be decoded
  std::int64_t blocks_decoded = 0;          // each as often as it was
  double seconds = 0;
  std::vector<std::string> plan;      // how it was done, a line a step
  std::vector<std::string> warnings;  // what a user should know of this map
};

/// Writes a cloud-optimized GeoTIFF with all its levels, and with the loss of each tile towards the next level.
///
/// Names, nodata, scale, offset, units, colours and metadata of the bands are kept, statistics are counted. Reduction
/// leaves out what is invalid (nodata, mask, alpha, NaN); radar in dB is averaged in power, labels take their most
/// frequent value. The same sources and options give the same bytes, whatever the threads, the memory, the division
/// into shards and however often it was interrupted.
/// `output` appears whole or not at all. Beside it, `output`.building keeps what is done until then, twice the map's
/// size at most; a later call with the same sources and options goes on from there. GDAL prints nothing meanwhile, on
/// any thread.
Result<BuildReport> build(const BuildOptions& options);

}  // namespace nadir::pyramid

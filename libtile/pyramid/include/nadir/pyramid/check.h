#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nadir/pyramid/build.h"

namespace nadir::pyramid {

struct CheckOptions {
  std::string map;
  int threads = 0;                         // 0: one a core
  std::uint64_t memory_bytes = 256 << 20;  // for decoded tiles
  bool show_progress = true;
};

/// One level of a map, and how it follows from the one before.
struct LevelCheck {
  LevelSize size;
  std::int64_t tiles = 0, empty_tiles = 0, damaged_tiles = 0;
  std::uint64_t bytes = 0;  // of packed tiles, masks among them
  bool compared = false;
  double rms = 0, greatest = 0;  // difference from what the level before gives, in stored units
  std::int64_t different = 0;    // texels that differ where none may, or differ by more than they may
};

struct CheckReport {
  std::vector<LevelCheck> levels;
  bool cloud_optimized = false;
  std::string reduction;            // by which levels were compared: "lanczos"; empty: not compared
  std::string bound;                // how far levels may differ: "not at all"
  std::vector<std::string> faults;  // what is wrong and where, finest level first; the first thousand
  std::int64_t fault_count = 0;
  std::vector<std::string> notes;  // what is worth knowing and no fault
  double seconds = 0;
};

/// Whether a map is whole: its structure (directories, tables, tiles within the file and apart from one another, order
/// and leaders of a cloud-optimized GeoTIFF, sizes and masks of levels, stored losses, georeference); every tile
/// decodes; and every level is what the one before gives by the filter that the map names:
/// - where the codec keeps samples, bit by bit;
/// - LERC within E: by |differences| <= (1 + g) E and a step of rounding, g the sum of the filter's absolute weights;
/// - JPEG: brightness within RMS (1 + r) e + 1.5 levels, e^2 the mean of (q / 2)^2 over the quantization table (its DCT
///   is orthonormal, and no coefficient is off by more than q / 2), r the filter's greatest gain (1, Lanczos 1.3);
///   colour differences are not bounded where they are stored at half the resolution;
/// - lossy WebP, and maps that do not name a filter: told, not judged.
/// A damaged tile does not keep the others from being looked at. Error: where the map cannot be opened at all.
/// GDAL prints nothing meanwhile, on any thread.
Result<CheckReport> check(const CheckOptions& options);

}  // namespace nadir::pyramid

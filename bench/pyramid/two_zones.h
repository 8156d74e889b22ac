#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::bench {

/// How far a mosaic lies from the truth.
struct MosaicError {
  double position_rms_texels = 0, position_max_texels = 0;  // shift of blocks of 32 x 32 texels that fits them best
  double rms = 0;                                           // of texels' values, levels of 255, all over the mosaic
  double seam_rms = 0, seam_max = 0;                        // within 4 texels of the seam between the zones
  std::size_t blocks = 0, seam_texels = 0;                  // that were looked at
};

/// Scenes of 1024 x 1024 texels of 10 m on both sides of the meridian of 12 degrees, half of them in UTM zone 32 and
/// half in zone 33, in rows that overlap across the meridian by 8 to about 50 texels (it is not parallel to either
/// zone's columns). What they show is a function of longitude and latitude: waves of 16 texels, so that the right
/// value is known wherever a texel ends up. 0 stands for nothing, and occurs nowhere within.
class TwoZones {
 public:
  static constexpr int side = 1024;
  static constexpr double texel_m = 10;

  /// At least 2 scenes.
  explicit TwoZones(int scenes);

  /// Writes them as cloud-optimized GeoTIFFs (DEFLATE) into a folder of their own within `folder`, where they are not
  /// there yet, on `threads` threads. That folder.
  Result<std::filesystem::path> write(const std::filesystem::path& folder, int threads) const;

  /// Names of the files of zone 32 or 33.
  std::vector<std::string> names(int zone) const;

  /// Compares a mosaic in the coordinates of zone 32 with the truth.
  Result<MosaicError> errors_of(const std::string& map) const;

 private:
  struct Scene {
    int zone;
    double left, top;  // metres
    std::string name;
  };
  bool covers(double easting, double northing) const;
  std::vector<Scene> scenes_;
};

}  // namespace nadir::bench

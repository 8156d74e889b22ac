#pragma once

#include <gdal_priv.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "peer.h"

namespace nadir::bench {

/// A map with its levels, each opened as a dataset of its own; for one thread at a time.
class GdalLevels {
 public:
  static Result<GdalLevels> open(const std::string& path);

  int count() const { return static_cast<int>(levels_.size()); }
  GDALDataset& dataset(int level) const { return *levels_[static_cast<std::size_t>(level)]; }
  int width(int level) const { return dataset(level).GetRasterXSize(); }
  int height(int level) const { return dataset(level).GetRasterYSize(); }
  /// Level-0 texels to one of the level's.
  double texels_x(int level) const { return 1.0 * width(0) / width(level); }
  double texels_y(int level) const { return 1.0 * height(0) / height(level); }
  int bands() const { return dataset(0).GetRasterCount(); }
  GDALDataType type() const { return dataset(0).GetRasterBand(1)->GetRasterDataType(); }
  int texel_bytes() const { return bands() * GDALGetDataTypeSizeBytes(type()); }

  /// The level whose texels are nearest in size to so many of level 0.
  int nearest(double texels) const;

  /// A window of a level, bands interleaved.
  Result<void> read(int level, int x, int y, int width, int height, void* out) const;

 private:
  std::vector<std::unique_ptr<GDALDataset>> levels_;
};

/// Side of a square as large as what a pixel shows, in level-0 texels.
inline double footprint_texels(const MapPoint& at) {
  return std::sqrt(std::abs(at.dx_du * at.dy_dv - at.dx_dv * at.dy_du));
}

}  // namespace nadir::bench

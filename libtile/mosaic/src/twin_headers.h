#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "raster_header.h"

namespace nadir::mosaic {

/// Headers of rasters, of which those that one program wrote in one go differ by little more than their place: a TIFF
/// whose fields are, byte for byte, those of one before it is not asked of GDAL again, which takes its time over each
/// CRS.
/// Thread-safe.
class TwinHeaders {
 public:
  /// As read_header().
  Result<RasterHeader> read(const NamedRaster& raster);

  /// How many were not read by GDAL.
  int twins() const { return twins_; }

 private:
  /// What of a TIFF differs among twins, and all that does not.
  struct Fields {
    std::string same;
    double x = 0, y = 0;  // CRS units, of the corner of the first texel
    std::string date_time;
  };
  static std::optional<Fields> fields_of(const tiff::TiffFile& tiff);

  struct Known {
    RasterHeader header;
    Fields fields;
  };
  std::mutex mutex_;                                                     // guards known_ and twins_
  std::unordered_map<std::string, std::shared_ptr<const Known>> known_;  // by Fields::same
  int twins_ = 0;
};

}  // namespace nadir::mosaic

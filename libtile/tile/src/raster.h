#pragma once

#include <memory>
#include <span>

#include "nadir/base/byte_source.h"
#include "nadir/tile/map.h"
#include "tiff_tiles.h"

namespace nadir::tile {

/// What a map reads its texels from.
/// Thread-safe.
class Raster {
 public:
  explicit Raster(MapDescription description) : description_(std::move(description)) {}
  virtual ~Raster() = default;
  Raster(const Raster&) = delete;
  Raster& operator=(const Raster&) = delete;

  const MapDescription& description() const { return description_; }

  /// The texels of a window, `bands` as `type`, with what mask or alpha say of their validity.
  virtual Result<Texels> read(int level, const Window& window, std::span<const int> bands, SampleType type) const = 0;

  /// Its stored tiles, where they are decoded here; else null.
  virtual const TiffTiles* tiles() const { return nullptr; }

 private:
  const MapDescription description_;
};

/// Any raster that GDAL opens, georeferenced or not.
Result<MapDescription> describe_by_gdal(const std::string& path);

/// Any raster that GDAL opens. Fails as `Map::open` does.
Result<std::unique_ptr<Raster>> open_gdal_raster(const std::string& path);

/// A tiled TIFF whose tiles are decoded here; what its headers leave open is asked of GDAL where it is a file on disk.
/// Unsupported where it is another raster.
Result<std::unique_ptr<Raster>> open_tiff_raster(std::shared_ptr<const ByteSource> source);

}  // namespace nadir::tile

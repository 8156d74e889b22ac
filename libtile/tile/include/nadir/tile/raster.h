#pragma once

#include <memory>
#include <span>

#include "nadir/base/module.h"
#include "nadir/tile/map.h"

namespace nadir::tile {

class TiffTiles;

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

/// What needs GDAL, from the module that holds it.
struct RasterModule {
  /// Any raster that GDAL opens, georeferenced or not.
  Result<MapDescription> (*describe)(const std::string& path);
  /// Any raster that GDAL opens. Fails as `Map::open` does.
  Result<std::unique_ptr<Raster>> (*open)(const std::string& path);
  /// See `limit_gdal_block_cache`.
  void (*limit_block_cache)(std::uint64_t bytes);
};
inline constexpr const char* raster_module_entry = "nadir_raster_module_1";

/// Loads it at the first call.
Result<const RasterModule*> raster_module();

/// Warnings that hold for every raster.
void add_warnings(MapDescription& map);

/// Whether `level`, from a list whose first is `full`, shrinks both axes alike.
bool level_belongs(const Level& level, const Level& full);

}  // namespace nadir::tile

#include <atomic>

#include "nadir/tile/raster.h"

namespace nadir::tile {
namespace {

std::atomic<std::uint64_t> block_cache_bytes{0};  // 0: no limit was asked for
std::atomic<bool> loaded{false};

}  // namespace

Result<const RasterModule*> raster_module() {
  static LazyModule<RasterModule> module(
      {"nadir_gdal.so", raster_module_entry, "only tiled GeoTIFFs can be read", "GDAL"});
  const auto found = module.get();
  if (found && !loaded.exchange(true) && block_cache_bytes > 0) (*found)->limit_block_cache(block_cache_bytes);
  return found;
}

void limit_gdal_block_cache(std::uint64_t bytes) {
  block_cache_bytes = bytes;
  if (!loaded) return;  // it is told when it comes
  if (const auto module = raster_module()) (*module)->limit_block_cache(bytes);
}

}  // namespace nadir::tile

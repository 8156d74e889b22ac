// The module's two functions: what geodesy and what maps need of GDAL.
#include "crs.h"
#include "nadir/gdal/raster.h"

extern "C" [[gnu::visibility("default")]] const nadir::geodesy::CrsModule* nadir_crs_module_1() {
  static constexpr nadir::geodesy::CrsModule module = {&nadir::gdal::open_crs, &nadir::gdal::geoid_height_m};
  return &module;
}

extern "C" [[gnu::visibility("default")]] const nadir::tile::RasterModule* nadir_raster_module_1() {
  static constexpr nadir::tile::RasterModule module = {&nadir::gdal::describe_by_gdal, &nadir::gdal::open_gdal_raster,
                                                       &nadir::gdal::limit_block_cache};
  return &module;
}

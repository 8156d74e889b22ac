#include "nadir/geodesy/crs_module.h"

namespace nadir::geodesy {

Result<const CrsModule*> crs_module() {
  static LazyModule<CrsModule> module(
      {"nadir_gdal.so", crs_module_entry, "only WGS-84 in degrees, UTM and Web Mercator can be calculated", "GDAL"});
  return module.get();
}

}  // namespace nadir::geodesy

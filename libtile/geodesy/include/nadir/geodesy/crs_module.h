#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "nadir/base/module.h"
#include "nadir/geodesy/geodetic.h"

namespace nadir::geodesy {

/// A CRS as the projection library knows it.
/// Thread-safe.
class LibraryCrs {
 public:
  virtual ~LibraryCrs() = default;

  std::string name;            // "EPSG:32614" where it is in that registry, else its name
  std::string wkt;             // WKT2
  std::string datum;           // "World Geodetic System 1984 ensemble"
  std::optional<int> same_as;  // the EPSG code that says all of it, where there is one
  bool geographic = false;
  double degrees_per_unit = 1;  // of a geographic CRS

  enum class Direction { Into, OutOf };
  /// In place, (lon_deg, lat_deg) into (x, y) of the CRS or out of it. What it cannot relate becomes NaN.
  virtual void transform(Direction direction, std::span<Eigen::Vector2d> points) const = 0;
};

/// What needs the projection library, from the module that holds it.
struct CrsModule {
  Result<std::shared_ptr<const LibraryCrs>> (*open)(const std::string& definition);
  Result<double> (*geoid_height_m)(double lat_rad, double lon_rad);
};
inline constexpr const char* crs_module_entry = "nadir_crs_module_1";

/// Loads it at the first call.
Result<const CrsModule*> crs_module();

}  // namespace nadir::geodesy

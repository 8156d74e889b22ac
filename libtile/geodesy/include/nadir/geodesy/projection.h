#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "nadir/base/result.h"
#include "nadir/geodesy/geodetic.h"

namespace nadir::geodesy {

/// Longitude and latitude (WGS-84) to the coordinates of one CRS and back.
///
/// CRS coordinates are in the CRS's own units, east or x first: metres or feet where it is projected, degrees
/// where it is geographic. Where x is a longitude it may pass 180 degrees: `wrap_around` picks the turn.
/// WGS-84 longitude and latitude, its UTM zones, its polar stereographic CRS (3031, 3413, 3976, 3995, UPS) and Web
/// Mercator are calculated here, within 0.2 micrometres of PROJ, and `uses_library()` says so; any other CRS goes
/// through PROJ, which is loaded then, takes about a microsecond a point, and is counted.
/// Cheap to copy; copies share the counter. Thread-safe.
class Projection {
 public:
  /// `definition`: EPSG:code, WKT, PROJ string: what PROJ knows.
  static Result<Projection> from_definition(const std::string& definition);

  /// "EPSG:32614" where the CRS is in that registry, else its name.
  const std::string& name() const;
  const std::string& datum() const;  // "World Geodetic System 1984 ensemble"
  bool uses_library() const;
  /// WKT2, which for a closed form the projection library has to be asked for.
  Result<std::string> wkt() const;

  /// Once around the Earth in units of x: 360 degrees of a geographic CRS, the equator of Web Mercator; none where x is
  /// no longitude.
  std::optional<double> turn() const;

  /// Turns of longitudes are chosen nearest to this x, in CRS units, so that a map which straddles the antimeridian has
  /// one range. No effect where there is no turn.
  void wrap_around(double x);

  /// In place, (lon_rad, lat_rad) to (x, y). Points outside the CRS's domain become NaN.
  void crs_from_lon_lat(std::span<Eigen::Vector2d> points) const;
  /// In place, (x, y) to (lon_rad, lat_rad). Points outside the CRS's domain become NaN.
  void lon_lat_from_crs(std::span<Eigen::Vector2d> points) const;

  /// Points that went through the projection library so far, both ways.
  std::int64_t library_points() const;

  /// Same CRS and same turn of longitudes: mappings into one serve the other.
  friend bool operator==(const Projection& a, const Projection& b);

 private:
  struct Shared;
  explicit Projection(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}
  std::shared_ptr<Shared> shared_;
  std::optional<double> wrap_x_;
};

/// Whether EPSG:`code` is calculated here.
bool has_closed_form(int code);

}  // namespace nadir::geodesy

#pragma once

#include <string>
#include <string_view>

#include "nadir/base/result.h"
#include "nadir/geodesy/geodetic.h"

namespace nadir::geodesy {

/// What a typed height counts from.
enum class HeightDatum {
  Ellipsoid,  // WGS-84
  Msl,        // mean sea level: the EGM96 geoid
  Agl,        // the scene's ground
};
std::string_view to_string(HeightDatum datum);

/// A height as people type it: "120", "120 ellipsoid", "120 msl", "120 agl". Without a suffix: ellipsoid.
struct TypedHeight {
  double value_m = 0;
  HeightDatum datum = HeightDatum::Ellipsoid;
};
Result<TypedHeight> parse_height(std::string_view text);

/// Name of the geoid model in use.
inline constexpr std::string_view geoid_name = "EGM96";

/// Height of the EGM96 geoid above the WGS-84 ellipsoid at a place, metres. Interpolated in PROJ's 15' grid
/// (package proj-data); error against the full model up to about 1 m in rough terrain. Fails where that
/// grid is not installed.
Result<double> geoid_height_m(double lat_rad, double lon_rad);

/// Metres above the ellipsoid of a typed height at a place where the ground is `ground_m` above the ellipsoid.
Result<double> ellipsoidal_height_m(const TypedHeight& height, double lat_rad, double lon_rad, double ground_m);

}  // namespace nadir::geodesy

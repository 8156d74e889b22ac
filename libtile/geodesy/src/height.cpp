#include "nadir/geodesy/height.h"

#include <fmt/format.h>
#include <ogr_spatialref.h>

#include <array>
#include <cmath>
#include <memory>

#include "nadir/base/text.h"

namespace nadir::geodesy {
namespace {

constexpr std::array<std::string_view, 3> datum_names = {"ellipsoid", "msl", "agl"};

struct DestroyTransformation {
  void operator()(OGRCoordinateTransformation* t) const { OGRCoordinateTransformation::DestroyCT(t); }
};

}  // namespace

std::string_view to_string(HeightDatum datum) { return datum_names[static_cast<std::size_t>(datum)]; }

Result<TypedHeight> parse_height(std::string_view text) {
  const std::string_view whole = trim(text);
  const std::size_t end = whole.find_first_of(" \t");
  const auto value = parse_number(whole.substr(0, end));
  if (!value)
    return fail(
        Error::Kind::Malformed,
        fmt::format("height '{}': expected metres with an optional datum, such as '120', '120 msl' or '120 agl'",
                    whole));
  if (end == std::string_view::npos) return TypedHeight{*value, HeightDatum::Ellipsoid};
  const std::string_view word = trim(whole.substr(end));
  for (std::size_t i = 0; i < datum_names.size(); ++i)
    if (word == datum_names[i]) return TypedHeight{*value, static_cast<HeightDatum>(i)};
  return fail(Error::Kind::Malformed,
              fmt::format("height '{}': unknown datum '{}'{}", whole, word, suggestion(word, datum_names)));
}

Result<double> geoid_height_m(double lat_rad, double lon_rad) {
  // One transformation a thread: OGR's are not to be shared.
  thread_local const auto ellipsoid_from_geoid = [] {
    OGRSpatialReference sea_level, ellipsoid;
    sea_level.importFromEPSG(9707);  // WGS 84 + EGM96 height
    ellipsoid.importFromEPSG(4979);  // WGS 84, three-dimensional
    sea_level.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    ellipsoid.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    OGRCoordinateTransformationOptions options;
    options.SetBallparkAllowed(false);
    return std::unique_ptr<OGRCoordinateTransformation, DestroyTransformation>(
        OGRCreateCoordinateTransformation(&sea_level, &ellipsoid, options));
  }();
  double x = to_degrees(lon_rad), y = to_degrees(lat_rad), z = 0;
  if (!ellipsoid_from_geoid || !ellipsoid_from_geoid->Transform(1, &x, &y, &z) || !std::isfinite(z))
    return fail(Error::Kind::NotFound,
                "heights above mean sea level need PROJ's EGM96 grid: install the package proj-data");
  return z;
}

Result<double> ellipsoidal_height_m(const TypedHeight& height, double lat_rad, double lon_rad, double ground_m) {
  switch (height.datum) {
    case HeightDatum::Ellipsoid:
      return height.value_m;
    case HeightDatum::Agl:
      return height.value_m + ground_m;
    case HeightDatum::Msl:
      break;
  }
  const auto geoid_m = geoid_height_m(lat_rad, lon_rad);
  if (!geoid_m) return geoid_m;
  return height.value_m + *geoid_m;
}

}  // namespace nadir::geodesy

#include "crs.h"

#include <cpl_error.h>
#include <fmt/format.h>
#include <ogr_spatialref.h>

#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

namespace nadir::gdal {
using geodesy::LibraryCrs, geodesy::to_degrees;
namespace {

struct DestroyTransformation {
  void operator()(OGRCoordinateTransformation* t) const { OGRCoordinateTransformation::DestroyCT(t); }
};
using Transformation = std::unique_ptr<OGRCoordinateTransformation, DestroyTransformation>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Keeps GDAL's messages off the user's terminal while in scope; the last one stays to be asked for.
struct QuietGdal {
  QuietGdal() { CPLPushErrorHandler(CPLQuietErrorHandler), CPLErrorReset(); }
  ~QuietGdal() { CPLPopErrorHandler(); }
};

OGRSpatialReference wgs84() {
  OGRSpatialReference srs;
  srs.importFromEPSG(4326);
  srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return srs;
}

std::string short_name(const OGRSpatialReference& srs) {
  const char* authority = srs.GetAuthorityName(nullptr);
  const char* code = srs.GetAuthorityCode(nullptr);
  if (authority && code) return fmt::format("{}:{}", authority, code);
  const char* name = srs.GetName();
  return name ? name : "unnamed";
}

std::string wkt_of(const OGRSpatialReference& srs) {
  char* text = nullptr;
  const std::array<const char*, 3> options = {"FORMAT=WKT2_2019", "MULTILINE=NO", nullptr};
  srs.exportToWkt(&text, options.data());
  std::string wkt = text ? text : "";
  CPLFree(text);
  return wkt;
}

/// Runs one OGR transformation over (x, y) points, in place; failures become NaN.
void run(OGRCoordinateTransformation& t, std::span<Eigen::Vector2d> points) {
  const QuietGdal quiet;
  std::vector<double> x(points.size()), y(points.size());
  std::vector<int> ok(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) x[i] = points[i].x(), y[i] = points[i].y();
  t.Transform(static_cast<int>(points.size()), x.data(), y.data(), nullptr, ok.data());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool usable = ok[i] && std::isfinite(x[i]) && std::isfinite(y[i]);
    points[i] = usable ? Eigen::Vector2d(x[i], y[i]) : Eigen::Vector2d(nan, nan);
  }
}

/// The EPSG code that says all of a CRS which closed forms are written for, where it is one of these.
std::optional<int> same_as(const OGRSpatialReference& crs, const OGRSpatialReference& lon_lat) {
  const std::array<const char*, 4> equivalence = {"CRITERION=EQUIVALENT", "IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES",
                                                  "IGNORE_COORDINATE_EPOCH=YES", nullptr};
  if (crs.IsGeographic()) return crs.IsSame(&lon_lat, equivalence.data()) ? std::optional(4326) : std::nullopt;
  const char *authority = crs.GetAuthorityName(nullptr), *code = crs.GetAuthorityCode(nullptr);
  if (!authority || !code || std::string_view(authority) != "EPSG") return std::nullopt;
  OGRSpatialReference registered;
  if (registered.importFromEPSG(std::atoi(code)) != OGRERR_NONE) return std::nullopt;
  return crs.IsSame(&registered, equivalence.data()) ? std::optional(std::atoi(code)) : std::nullopt;
}

class OgrCrs : public LibraryCrs {
 public:
  OgrCrs(Transformation into, Transformation out_of) : original_{std::move(into), std::move(out_of)} {}

  void transform(Direction direction, std::span<Eigen::Vector2d> points) const override {
    const auto d = static_cast<std::size_t>(direction);
    Transformation t = borrow(d);
    run(*t, points);
    const std::scoped_lock lock(mutex_);
    idle_[d].push_back(std::move(t));
  }

 private:
  // A transformation serves one thread at a time: threads borrow one and give it back.
  Transformation borrow(std::size_t direction) const {
    const std::scoped_lock lock(mutex_);
    if (idle_[direction].empty()) return Transformation(original_[direction]->Clone());
    Transformation t = std::move(idle_[direction].back());
    idle_[direction].pop_back();
    return t;
  }

  const std::array<Transformation, 2> original_;  // by direction; only ever cloned
  mutable std::mutex mutex_;                      // guards idle_
  mutable std::array<std::vector<Transformation>, 2> idle_;
};

}  // namespace

Result<std::shared_ptr<const LibraryCrs>> open_crs(const std::string& definition) {
  const QuietGdal quiet;
  OGRSpatialReference crs;
  if (crs.SetFromUserInput(definition.c_str(), OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS_get()) !=
      OGRERR_NONE)
    return fail(Error::Kind::Malformed, fmt::format("'{}': expected a CRS that PROJ knows, such as EPSG:32614: {}",
                                                    definition.substr(0, 80), CPLGetLastErrorMsg()));
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);

  const std::string name = short_name(crs), wkt = wkt_of(crs);
  const char* datum = crs.GetAttrValue("DATUM");
  const std::string datum_name = datum ? datum : "unnamed datum";
  if (crs.IsLocal() || crs.IsGeocentric())
    return fail(Error::Kind::Unsupported, fmt::format("CRS '{}': expected a geographic or projected CRS", name));

  // PROJ's grids and our ellipsoid are the Earth's: all of its ellipsoids and spheres lie within 0.3 %, Venus 5 %
  // below.
  constexpr double earth_m = 6378137;
  if (const double radius_m = crs.GetSemiMajor(); !(std::abs(radius_m / earth_m - 1) < 0.01))
    return fail(
        Error::Kind::Unsupported,
        fmt::format("CRS '{}': expected one of the Earth, found one of a body of {:.0f} m radius", name, radius_m));

  // Heights of a compound or three-dimensional CRS play no part in where a texel lies.
  if (crs.IsCompound()) crs.StripVertical();
  crs.DemoteTo2D(nullptr);
  const OGRSpatialReference lon_lat = wgs84();
  Transformation into(OGRCreateCoordinateTransformation(&lon_lat, &crs)),
      out_of(OGRCreateCoordinateTransformation(&crs, &lon_lat));
  if (!into || !out_of)
    return fail(
        Error::Kind::Unsupported,
        fmt::format(
            "CRS '{}': PROJ knows no way between it and WGS-84; warp the map to another CRS with gdalwarp -t_srs",
            name));
  auto opened = std::make_shared<OgrCrs>(std::move(into), std::move(out_of));
  opened->name = name;
  opened->wkt = wkt;
  opened->datum = datum_name;
  opened->same_as = same_as(crs, lon_lat);
  opened->geographic = crs.IsGeographic();
  if (opened->geographic) opened->degrees_per_unit = to_degrees(crs.GetAngularUnits());
  return std::shared_ptr<const LibraryCrs>(std::move(opened));
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

}  // namespace nadir::gdal

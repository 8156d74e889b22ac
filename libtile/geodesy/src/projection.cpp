#include "nadir/geodesy/projection.h"

#include <cpl_error.h>
#include <fmt/format.h>
#include <ogr_spatialref.h>

#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

namespace nadir::geodesy {
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

}  // namespace

struct Projection::Shared {
  std::string name, wkt, datum;
  bool geographic = false, closed_form = false;
  double degrees_per_unit = 1;  // of a geographic CRS
  std::atomic<std::int64_t> points{0};

  // A transformation serves one thread at a time: threads borrow one and give it back.
  std::mutex mutex;  // guards idle
  std::vector<Transformation> idle[2];
  Transformation original[2];  // [0] into the CRS, [1] out of it; only ever cloned

  Transformation borrow(int direction) {
    std::scoped_lock lock(mutex);
    if (idle[direction].empty()) return Transformation(original[direction]->Clone());
    Transformation t = std::move(idle[direction].back());
    idle[direction].pop_back();
    return t;
  }
  void give_back(int direction, Transformation t) {
    std::scoped_lock lock(mutex);
    idle[direction].push_back(std::move(t));
  }
};

Result<Projection> Projection::from_definition(const std::string& definition) {
  const QuietGdal quiet;
  OGRSpatialReference crs;
  if (crs.SetFromUserInput(definition.c_str(), OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS_get()) !=
      OGRERR_NONE)
    return fail(Error::Kind::Malformed, fmt::format("'{}': expected a CRS that PROJ knows, such as EPSG:32614: {}",
                                                    definition.substr(0, 80), CPLGetLastErrorMsg()));
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);

  auto shared = std::make_shared<Shared>();
  shared->name = short_name(crs);
  shared->wkt = wkt_of(crs);
  const char* datum = crs.GetAttrValue("DATUM");
  shared->datum = datum ? datum : "unnamed datum";
  if (crs.IsLocal() || crs.IsGeocentric())
    return fail(Error::Kind::Unsupported,
                fmt::format("CRS '{}': expected a geographic or projected CRS", shared->name));

  // PROJ's grids and our ellipsoid are the Earth's: all of its ellipsoids and spheres lie within 0.3 %, Venus 5 %
  // below.
  constexpr double earth_m = 6378137;
  if (const double radius_m = crs.GetSemiMajor(); !(std::abs(radius_m / earth_m - 1) < 0.01))
    return fail(Error::Kind::Unsupported,
                fmt::format("CRS '{}': expected one of the Earth, found one of a body of {:.0f} m radius", shared->name,
                            radius_m));

  // Heights of a compound or three-dimensional CRS play no part in where a texel lies.
  if (crs.IsCompound()) crs.StripVertical();
  crs.DemoteTo2D(nullptr);
  shared->geographic = crs.IsGeographic();
  const OGRSpatialReference lon_lat = wgs84();
  const std::array<const char*, 4> equivalence = {"CRITERION=EQUIVALENT", "IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES",
                                                  "IGNORE_COORDINATE_EPOCH=YES", nullptr};
  shared->closed_form = shared->geographic && crs.IsSame(&lon_lat, equivalence.data());
  if (shared->geographic) shared->degrees_per_unit = to_degrees(crs.GetAngularUnits());

  if (!shared->closed_form) {
    shared->original[0].reset(OGRCreateCoordinateTransformation(&lon_lat, &crs));
    shared->original[1].reset(OGRCreateCoordinateTransformation(&crs, &lon_lat));
    if (!shared->original[0] || !shared->original[1])
      return fail(
          Error::Kind::Unsupported,
          fmt::format(
              "CRS '{}': PROJ knows no way between it and WGS-84; warp the map to another CRS with gdalwarp -t_srs",
              shared->name));
  }
  return Projection(std::move(shared));
}

const std::string& Projection::name() const { return shared_->name; }
const std::string& Projection::wkt() const { return shared_->wkt; }
const std::string& Projection::datum() const { return shared_->datum; }
bool Projection::uses_library() const { return !shared_->closed_form; }
void Projection::wrap_around(double x) { wrap_x_ = shared_->geographic ? std::optional(x) : std::nullopt; }
std::int64_t Projection::library_points() const { return shared_->points.load(std::memory_order_relaxed); }

bool operator==(const Projection& a, const Projection& b) {
  return (a.shared_ == b.shared_ || a.shared_->wkt == b.shared_->wkt) && a.wrap_x_ == b.wrap_x_;
}

namespace {

/// Runs one OGR transformation over (x, y) points, in place; failures become NaN.
void transform(OGRCoordinateTransformation& t, std::span<Eigen::Vector2d> points) {
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

}  // namespace

void Projection::crs_from_lon_lat(std::span<Eigen::Vector2d> points) const {
  for (auto& p : points) p = {to_degrees(p.x()), to_degrees(p.y())};
  if (!shared_->closed_form) {
    Transformation t = shared_->borrow(0);
    transform(*t, points);
    shared_->give_back(0, std::move(t));
    shared_->points.fetch_add(static_cast<std::int64_t>(points.size()), std::memory_order_relaxed);
  }
  if (wrap_x_) {
    const double turn = 360 / shared_->degrees_per_unit;
    for (auto& p : points) p.x() -= turn * std::round((p.x() - *wrap_x_) / turn);
  }
}

void Projection::lon_lat_from_crs(std::span<Eigen::Vector2d> points) const {
  if (!shared_->closed_form) {
    Transformation t = shared_->borrow(1);
    transform(*t, points);
    shared_->give_back(1, std::move(t));
    shared_->points.fetch_add(static_cast<std::int64_t>(points.size()), std::memory_order_relaxed);
  }
  for (auto& p : points) {
    if (!(std::abs(p.y()) <= 90)) p = {nan, nan};
    p = {to_radians(std::remainder(p.x(), 360.0)), to_radians(p.y())};
  }
}

}  // namespace nadir::geodesy

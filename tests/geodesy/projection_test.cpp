#include "nadir/geodesy/projection.h"

#include <gtest/gtest.h>

#include <GeographicLib/UTMUPS.hpp>
#include <array>
#include <cmath>
#include <numbers>

namespace nadir::geodesy {
namespace {

Eigen::Vector2d project(const Projection& projection, double lon_deg, double lat_deg) {
  std::array<Eigen::Vector2d, 1> p = {Eigen::Vector2d(to_radians(lon_deg), to_radians(lat_deg))};
  projection.crs_from_lon_lat(p);
  return p[0];
}

TEST(Projection, LongitudeAndLatitudeNeedNoLibrary) {
  const auto projection = Projection::from_definition("EPSG:4326").value();
  EXPECT_FALSE(projection.uses_library());
  EXPECT_NEAR((project(projection, -0.76, 38.1) - Eigen::Vector2d(-0.76, 38.1)).norm(), 0, 1e-14)
      << "x is longitude, whatever order the CRS prescribes";
  EXPECT_EQ(projection.library_points(), 0);
}

TEST(Projection, WebMercatorIsItsFormula) {
  const auto projection = Projection::from_definition("EPSG:3857").value();
  const double lat = to_radians(60), a = 6378137;
  const Eigen::Vector2d expected(a * to_radians(-99), a * std::log(std::tan(std::numbers::pi / 4 + lat / 2)));
  EXPECT_NEAR((project(projection, -99, 60) - expected).norm(), 0, 1e-8);
  EXPECT_EQ(projection.library_points(), 1);
}

TEST(Projection, UtmAgreesWithAnIndependentImplementation) {
  const auto projection = Projection::from_definition("EPSG:32636").value();
  for (const auto& [lat, lon] : {std::pair(0.3516, 32.5896), {-0.5, 35.9}, {72.0, 30.1}}) {
    int zone = 0;
    bool north = true;
    double x = 0, y = 0;
    GeographicLib::UTMUPS::Forward(lat, lon, zone, north, x, y, 36);
    if (!north) y -= 1e7;  // zone 36N has no false northing
    EXPECT_NEAR((project(projection, lon, lat) - Eigen::Vector2d(x, y)).norm(), 0, 1e-6);
  }
}

TEST(Projection, ComesBack) {
  for (const char* crs : {"EPSG:4326", "EPSG:3857", "EPSG:32614", "EPSG:26914", "EPSG:2263", "EPSG:3031"}) {
    const auto projection = Projection::from_definition(crs).value();
    const double lat = std::string(crs) == "EPSG:3031" ? -80 : 40.7, lon = std::string(crs) == "EPSG:2263" ? -74 : -99;
    std::array<Eigen::Vector2d, 1> p = {Eigen::Vector2d(to_radians(lon), to_radians(lat))};
    projection.crs_from_lon_lat(p);
    projection.lon_lat_from_crs(p);
    EXPECT_NEAR(to_degrees(p[0].x()), lon, 1e-9) << crs;
    EXPECT_NEAR(to_degrees(p[0].y()), lat, 1e-9) << crs;
  }
}

TEST(Projection, AMapAcrossTheAntimeridianHasOneRangeOfLongitudes) {
  auto projection = Projection::from_definition("EPSG:4326").value();
  projection.wrap_around(181);
  EXPECT_NEAR(project(projection, -179, 10).x(), 181, 1e-12);
  EXPECT_NEAR(project(projection, 179, 10).x(), 179, 1e-12);
  std::array<Eigen::Vector2d, 1> p = {Eigen::Vector2d(181, 10)};
  projection.lon_lat_from_crs(p);
  EXPECT_NEAR(to_degrees(p[0].x()), -179, 1e-12);
}

TEST(Projection, SaysWhereItIsNotDefined) {
  const auto projection = Projection::from_definition("EPSG:4326").value();
  std::array<Eigen::Vector2d, 1> p = {Eigen::Vector2d(10, 91)};
  projection.lon_lat_from_crs(p);
  EXPECT_FALSE(p[0].allFinite());
}

TEST(Projection, RefusesWhatHasNoWayToWgs84) {
  EXPECT_FALSE(Projection::from_definition("EPSG:999999"));
  EXPECT_FALSE(Projection::from_definition("no such thing"));
  EXPECT_EQ(Projection::from_definition("LOCAL_CS[\"site grid\",UNIT[\"metre\",1]]").error().kind,
            Error::Kind::Unsupported);
  EXPECT_FALSE(Projection::from_definition("/etc/passwd")) << "a definition names no file";
}

}  // namespace
}  // namespace nadir::geodesy

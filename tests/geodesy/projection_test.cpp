#include "nadir/geodesy/projection.h"

#include <gtest/gtest.h>

#include <GeographicLib/UTMUPS.hpp>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "nadir/geodesy/crs_module.h"

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
  EXPECT_FALSE(projection.uses_library());
}

struct Form {
  int code;
  double meridian_deg;
};
class ClosedForms : public testing::TestWithParam<Form> {};

TEST_P(ClosedForms, AgreeWithTheLibrary) {
  // All latitudes to 84 degrees, to 30 degrees beside the meridian; about 0.1 um of rounding at 1e7 m, and 5 nm of the
  // series.
  constexpr double bound_m = 2e-7;
  const std::string name = "EPSG:" + std::to_string(GetParam().code);
  const auto projection = Projection::from_definition(name).value();
  const auto library = crs_module().value()->open(name).value();
  ASSERT_FALSE(projection.uses_library());
  std::vector<Eigen::Vector2d> degrees;
  for (double lat = -84; lat <= 84; lat += 7)
    for (double beside = -30; beside <= 30; beside += 2.5) degrees.emplace_back(GetParam().meridian_deg + beside, lat);
  auto theirs = degrees, ours = degrees;
  for (auto& p : ours) p = {to_radians(p.x()), to_radians(p.y())};
  library->transform(LibraryCrs::Direction::Into, theirs);
  projection.crs_from_lon_lat(ours);
  double worst = 0;
  for (std::size_t i = 0; i < ours.size(); ++i) worst = std::max(worst, (ours[i] - theirs[i]).norm());
  EXPECT_LE(worst, bound_m);
  // And back, in metres on the ground
  projection.lon_lat_from_crs(ours);
  worst = 0;
  for (std::size_t i = 0; i < ours.size(); ++i)
    worst = std::max(
        worst, 6.4e6 * (ours[i] - Eigen::Vector2d(to_radians(degrees[i].x()), to_radians(degrees[i].y()))).norm());
  EXPECT_LE(worst, bound_m);
}
INSTANTIATE_TEST_SUITE_P(Projection, ClosedForms,
                         testing::Values(Form{3857, -20}, Form{32614, -99}, Form{32631, 3}, Form{32633, 15},
                                         Form{32714, -99}, Form{32755, 147}, Form{32606, -147}));

TEST(Projection, UtmEndsWhereTheLibraryEnds) {
  const auto projection = Projection::from_definition("EPSG:32631").value();
  const auto library = crs_module().value()->open("EPSG:32631").value();
  int defined = 0, undefined = 0;
  for (double lon = 3; lon < 183; lon += 1) {
    std::array<Eigen::Vector2d, 1> theirs = {Eigen::Vector2d(lon, 0.5)};
    library->transform(LibraryCrs::Direction::Into, theirs);
    const bool finite = project(projection, lon, 0.5).allFinite();
    (finite ? defined : undefined) += 1;
    EXPECT_EQ(finite, theirs[0].allFinite()) << lon;
  }
  EXPECT_GT(defined, 80);
  EXPECT_GT(undefined, 5);
}

TEST(Projection, AClosedFormIsTheSameCrsHoweverItIsDefined) {
  for (const char* code : {"EPSG:4326", "EPSG:3857", "EPSG:32614"}) {
    const auto by_code = Projection::from_definition(code).value();
    const auto by_wkt = Projection::from_definition(by_code.wkt().value()).value();
    EXPECT_FALSE(by_wkt.uses_library()) << code;
    EXPECT_TRUE(by_code == by_wkt);
  }
  // One that only looks like it
  const auto other = Projection::from_definition("+proj=utm +zone=14 +ellps=intl +type=crs").value();
  EXPECT_TRUE(other.uses_library());
  EXPECT_FALSE(other == Projection::from_definition("EPSG:32614").value());
}

TEST(Projection, OtherCrsGoThroughTheLibraryAndAreCounted) {
  const auto projection = Projection::from_definition("EPSG:3035").value();
  EXPECT_TRUE(projection.uses_library());
  EXPECT_TRUE(project(projection, 10, 52).isApprox(Eigen::Vector2d(4321000, 3210000))) << "its false origin";
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

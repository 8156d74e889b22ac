#include "nadir/geodesy/projection.h"

#include <gtest/gtest.h>

#include <GeographicLib/TransverseMercatorExact.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
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

/// Places spread evenly over the Earth, degrees.
std::vector<Eigen::Vector2d> random_places(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < count; ++i) places.emplace_back(180 * unit(random), to_degrees(std::asin(unit(random))));
  return places;
}

/// Distance on a sphere of the Earth's size, metres; both are degrees.
double distance_m(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const auto direction = [](const Eigen::Vector2d& p) {
    const double lon = to_radians(p.x()), lat = to_radians(p.y());
    return Eigen::Vector3d(std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat));
  };
  return 6378137 * (direction(a) - direction(b)).norm();
}

struct Polar {
  int code;
  double pole_lat_deg, true_lat_deg, scale, meridian_deg, false_origin_m;
};
class PolarForms : public testing::TestWithParam<Polar> {
 protected:
  const Polar form = GetParam();
  const std::string name = "EPSG:" + std::to_string(form.code);
  const Projection projection = Projection::from_definition(name).value();
  const double side = form.pole_lat_deg > 0 ? 1 : -1;

  /// Snyder, Map Projections - A Working Manual, 1987, equations 15-9, 14-15, 21-33 and 21-34.
  Eigen::Vector2d by_hand(double lon_deg, double lat_deg) const {
    const double f = 1 / 298.257223563, e = std::sqrt(f * (2 - f));
    const auto t = [&](double lat) {
      return std::tan(std::numbers::pi / 4 - lat / 2) *
             std::pow((1 + e * std::sin(lat)) / (1 - e * std::sin(lat)), e / 2);
    };
    const double c = to_radians(form.true_lat_deg), es = e * std::sin(c);
    const double factor = form.true_lat_deg == 90
                              ? 2 * form.scale / std::sqrt(std::pow(1 + e, 1 + e) * std::pow(1 - e, 1 - e))
                              : form.scale * std::cos(c) / std::sqrt(1 - es * es) / t(c);
    const double rho = 6378137 * factor * t(side * to_radians(lat_deg)), l = to_radians(lon_deg - form.meridian_deg);
    return Eigen::Vector2d(rho * std::sin(l), -side * rho * std::cos(l)) +
           Eigen::Vector2d::Constant(form.false_origin_m);
  }
};

TEST_P(PolarForms, AgreeWithTheLibraryAndTheFormula) {
  const auto library = crs_module().value()->open(name).value();
  ASSERT_FALSE(projection.uses_library());
  auto degrees = random_places(20000, 1);
  for (double lon = -180; lon <= 180; lon += 22.5)
    for (const double beside_pole : {0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 30.0, 90.0, 120.0})
      degrees.emplace_back(lon, side * (90 - beside_pole));
  auto theirs = degrees;
  library->transform(LibraryCrs::Direction::Into, theirs);
  double worst_m = 0, worst_by_hand_m = 0, worst_back_m = 0;
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    const Eigen::Vector2d ours = project(projection, degrees[i].x(), degrees[i].y());
    // Metres on the ground: at an angle from the pole the map is enlarged by 1 / cos^2 of its half.
    const double half = to_radians(90 - side * degrees[i].y()) / 2, enlarged = 1 / std::pow(std::cos(half), 2);
    worst_m = std::max(worst_m, (ours - theirs[i]).norm() / enlarged);
    worst_by_hand_m = std::max(worst_by_hand_m, (ours - by_hand(degrees[i].x(), degrees[i].y())).norm() / enlarged);
    std::array<Eigen::Vector2d, 1> back = {ours};
    projection.lon_lat_from_crs(back);
    worst_back_m = std::max(worst_back_m, distance_m({to_degrees(back[0].x()), to_degrees(back[0].y())}, degrees[i]));
  }
  EXPECT_LE(worst_m, 2e-7);
  EXPECT_LE(worst_by_hand_m, 2e-7);
  EXPECT_LE(worst_back_m, 2e-7);
  RecordProperty("worst_m", std::to_string(worst_m * 1e9) + " nm");
}

TEST_P(PolarForms, HaveOnePoleAndNotTheOther) {
  for (double lon = -180; lon <= 180; lon += 60) {
    const Eigen::Vector2d pole = project(projection, lon, form.pole_lat_deg);
    EXPECT_NEAR((pole - Eigen::Vector2d::Constant(form.false_origin_m)).norm(), 0, 1e-8);
    EXPECT_FALSE(project(projection, lon, -form.pole_lat_deg).allFinite());
  }
  std::array<Eigen::Vector2d, 1> p = {Eigen::Vector2d::Constant(form.false_origin_m)};
  projection.lon_lat_from_crs(p);
  EXPECT_NEAR(to_degrees(p[0].y()), form.pole_lat_deg, 1e-13);
  EXPECT_TRUE(std::isfinite(p[0].x()));
}

TEST_P(PolarForms, AreContinuousAcrossTheAntimeridian) {
  const double lat = 0.8 * form.pole_lat_deg;
  EXPECT_NEAR((project(projection, 180, lat) - project(projection, -180, lat)).norm(), 0, 1e-8);
  EXPECT_LT((project(projection, 179.9999999, lat) - project(projection, -179.9999999, lat)).norm(), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Projection, PolarForms,
                         testing::Values(Polar{3413, 90, 70, 1, -45, 0}, Polar{3995, 90, 71, 1, 0, 0},
                                         Polar{3031, -90, 71, 1, 0, 0}, Polar{3976, -90, 70, 1, 0, 0},
                                         Polar{32661, 90, 90, 0.994, 0, 2e6}, Polar{32761, -90, 90, 0.994, 0, 2e6},
                                         Polar{5041, 90, 90, 0.994, 0, 2e6}, Polar{5042, -90, 90, 0.994, 0, 2e6}));

TEST(Projection, UtmIsExactWhereverItIsDefined) {
  // Everywhere on the Earth: within 0.2 micrometres on the ground of elliptic functions and of PROJ, or not defined,
  // and that from 6500 km beside the meridian on.
  constexpr double bound_m = 2e-7, reach_m = 6.5e6;
  const auto& exact = GeographicLib::TransverseMercatorExact::UTM();
  for (const bool south : {false, true}) {
    const std::string name = south ? "EPSG:32731" : "EPSG:32631";
    const auto projection = Projection::from_definition(name).value();
    const auto library = crs_module().value()->open(name).value();
    const auto degrees = random_places(20000, 2);
    auto theirs = degrees;
    library->transform(LibraryCrs::Direction::Into, theirs);
    double worst_m = 0, worst_back_m = 0, worst_beside_library_m = 0, farthest_m = 0;
    int beyond_pole = 0, undefined = 0;
    for (std::size_t i = 0; i < degrees.size(); ++i) {
      const Eigen::Vector2d ours = project(projection, degrees[i].x(), degrees[i].y());
      Eigen::Vector2d expected;
      double convergence = 0, scale = 1;
      exact.Forward(3, degrees[i].y(), degrees[i].x(), expected.x(), expected.y(), convergence, scale);
      ASSERT_EQ(ours.allFinite(), std::abs(expected.x()) <= reach_m) << degrees[i].transpose();
      if (!ours.allFinite()) {
        ++undefined;
        continue;
      }
      farthest_m = std::max(farthest_m, std::abs(expected.x()));
      beyond_pole += std::abs(std::remainder(degrees[i].x() - 3, 360)) > 90;
      expected += Eigen::Vector2d(500000, south ? 1e7 : 0);
      worst_m = std::max(worst_m, (ours - expected).norm() / scale);
      worst_beside_library_m = std::max(worst_beside_library_m, (ours - theirs[i]).norm() / scale);
      std::array<Eigen::Vector2d, 1> back = {ours};
      projection.lon_lat_from_crs(back);
      worst_back_m = std::max(worst_back_m, distance_m({to_degrees(back[0].x()), to_degrees(back[0].y())}, degrees[i]));
    }
    EXPECT_LE(worst_m, bound_m);
    EXPECT_GE(worst_m, bound_m / 10) << "these samples no longer exercise the bound";
    EXPECT_LE(worst_beside_library_m, bound_m);
    EXPECT_LE(worst_back_m, bound_m);
    EXPECT_GT(farthest_m, 0.99 * reach_m);
    EXPECT_GT(beyond_pole, 1000);
    EXPECT_GT(undefined, 1000);
  }
}

TEST(Projection, UtmHasNoCoordinatesFarFromItsMeridian) {
  const auto projection = Projection::from_definition("EPSG:32631").value();
  for (double beside = -180; beside <= 180; beside += 1) {
    const double aside = std::abs(beside) > 90 ? 180 - std::abs(beside) : std::abs(beside);
    EXPECT_EQ(project(projection, 3 + beside, 0).allFinite(), aside <= 50) << beside;
  }
  for (const double beside : {-180.0, -90.0, 90.0, 180.0}) EXPECT_TRUE(project(projection, 3 + beside, 89).allFinite());
  // Nor places where there are none: 7000 km beside the meridian, or further north than over the pole to the equator
  for (const Eigen::Vector2d& nowhere :
       {Eigen::Vector2d(7.1e6, 5e6), {-6.1e6, 5e6}, {500000, 2.1e7}, {500000, -2.1e7}}) {
    std::array<Eigen::Vector2d, 1> p = {nowhere};
    projection.lon_lat_from_crs(p);
    EXPECT_FALSE(p[0].allFinite()) << nowhere.transpose();
  }
}

TEST(Projection, AClosedFormIsTheSameCrsHoweverItIsDefined) {
  for (const char* code : {"EPSG:4326", "EPSG:3857", "EPSG:32614", "EPSG:3413", "EPSG:3031", "EPSG:32661"}) {
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

  auto mercator = Projection::from_definition("EPSG:3857").value();
  const double half_around = std::numbers::pi * 6378137;
  EXPECT_NEAR(project(mercator, -179, 10).x(), -half_around * 179 / 180, 1e-8);
  mercator.wrap_around(half_around);
  EXPECT_NEAR(project(mercator, -179, 10).x(), half_around * 181 / 180, 1e-8);
  EXPECT_NEAR(project(mercator, 179, 10).x(), half_around * 179 / 180, 1e-8);
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

#include "nadir/sim/environment.h"

#include <gtest/gtest.h>

#include <GeographicLib/NormalGravity.hpp>
#include <cmath>

#include "nadir/sim/atmosphere.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;

TEST(StandardAir, AgreesWithTheTablesOfTheStandard) {
  // U.S. Standard Atmosphere, 1976, table 1, density by geometric height, each to its printed digits.
  struct Row {
    double height_m, density, digit;
  };
  for (const Row& row :
       {Row{0, 1.2250, 1e-4}, Row{1000, 1.1117, 1e-4}, Row{3000, 9.0925e-1, 1e-5}, Row{10000, 4.1351e-1, 1e-5},
        Row{15000, 1.9476e-1, 1e-5}, Row{25000, 4.0084e-2, 1e-6}, Row{50000, 1.0269e-3, 1e-7}})
    EXPECT_NEAR(standard_air(row.height_m).density_kgpm3, row.density, row.digit / 2) << row.height_m;
}

TEST(StandardAir, IsContinuousAcrossLayersAndThinsOutWithoutEnd) {
  for (const double border_gp : {11000.0, 20000.0, 32000.0, 47000.0, 51000.0, 71000.0, 84852.0}) {
    const double border_m = border_gp * 6356766 / (6356766 - border_gp);
    const double below = standard_air(border_m - 1e-3).pressure_pa, above = standard_air(border_m + 1e-3).pressure_pa;
    // 2 mm are 4e-7 of pressure at the thinnest; base pressures are tabulated to 7 digits.
    EXPECT_NEAR(above / below, 1, 2e-6) << border_gp;
  }
  for (double h = -1000; h < 1e6; h *= h < 0 ? -1.0 : 1.1) {
    const double here = standard_air(h).density_kgpm3;
    EXPECT_GE(here, standard_air(h + 500).density_kgpm3);
    EXPECT_TRUE(std::isfinite(here) && here >= 0) << h;
  }
}

TEST(Wgs84Environment, HasTheNormalGravityOfTheEllipsoid) {
  // The harmonic left out, J6 = 6.1e-9, pulls with at most P'_7(1) = 28 times that of g: 1.7e-6 m/s^2.
  const auto& normal = GeographicLib::NormalGravity::WGS84();
  const Environment environment = Environment::wgs84();
  double worst = 0;
  for (const double lat : {-90.0, -60.0, -33.3, 0.0, 20.0, 45.0, 89.999, 90.0})
    for (const double height : {-100.0, 0.0, 3000.0, 100000.0}) {
      const auto p = geodesy::ecef_from_geodetic(Geodetic::degrees(lat, 37, height));
      Vector3d expected;
      normal.U(p.xyz.x(), p.xyz.y(), p.xyz.z(), expected.x(), expected.y(), expected.z());
      worst = std::max(worst, (environment.at(p).gravity_ecef_mps2 - expected).norm());
    }
  EXPECT_LT(worst, 3e-6);
  EXPECT_GT(worst, 1e-7) << "these places no longer exercise the bound";
}

TEST(Wgs84Environment, KnowsNorthEastDownAndHeightEverywhereEvenAtThePoles) {
  const Environment environment = Environment::wgs84();
  for (const double lat : {-90.0, -89.9999, -45.0, 0.0, 0.001, 38.1, 90.0})
    for (const double lon : {-180.0, -0.76, 90.0, 179.9999})
      for (const double height : {-400.0, 0.0, 120.0, 12000.0, 90000.0}) {
        if (std::abs(lat) == 90 && lon != 90.0) continue;  // rounding of the cosine leaves a longitude there
        const auto place = Geodetic::degrees(lat, lon, height);
        const auto p = geodesy::ecef_from_geodetic(place);
        const Surroundings here = environment.at(p);
        // One step of Bowring is off by up to 1e-11 rad at these heights, and the position by 1e-9 m in 6.4e6 m.
        EXPECT_NEAR(here.height_m, height, 1e-8);
        if (std::abs(lat) == 90) {
          EXPECT_NEAR(here.ecef_from_ned(2, 2), -std::copysign(1.0, lat), 1e-15);
          continue;
        }
        const Eigen::Matrix3d expected = geodesy::ecef_from_ned(place).rotation.toRotationMatrix();
        EXPECT_LT((here.ecef_from_ned - expected).norm(), 1e-10 / std::cos(place.lat_rad) * 1e-4 + 1e-10)
            << lat << " " << lon;
      }
  const Surroundings pole = environment.at({Vector3d(0, 0, 6356752.3142)});
  EXPECT_TRUE(pole.ecef_from_ned.allFinite());
  EXPECT_EQ(pole.ecef_from_ned.col(1), Vector3d(0, 1, 0)) << "at the pole itself, east is that of longitude 0";
}

TEST(Wgs84Environment, CountsTheAtmosphereFromTheSea) {
  const auto p = geodesy::ecef_from_geodetic(Geodetic::degrees(38, 0, 1050));
  EXPECT_NEAR(Environment::wgs84(50).at(p).density_kgpm3, 1.1117, 0.5e-4) << "1000 m above the sea";
}

TEST(FlatEnvironment, IsTheSameEverywhereAndDoesNotTurn) {
  const auto origin = Geodetic::degrees(38.1, -0.76, 100);
  const Environment environment = Environment::flat(origin);
  const auto ecef_from_ned = geodesy::ecef_from_ned(origin);
  for (const Vector3d& ned : {Vector3d(0, 0, 0), Vector3d(5000, -3000, -700)}) {
    const Surroundings here = environment.at(ecef_from_ned * geodesy::Point<geodesy::frame::Ned>{ned});
    EXPECT_NEAR(here.height_m, -ned.z(), 1e-8);
    EXPECT_NEAR((ecef_from_ned.rotation.conjugate() * here.gravity_ecef_mps2 - Vector3d(0, 0, 9.81)).norm(), 0, 1e-14);
    EXPECT_EQ(here.density_kgpm3, 1.2682);
    EXPECT_EQ(here.earth_rate_ecef_radps, Vector3d::Zero());
  }
}

}  // namespace
}  // namespace nadir::sim

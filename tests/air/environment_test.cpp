#include "nadir/sim/environment.h"

#include <gtest/gtest.h>

#include <GeographicLib/NormalGravity.hpp>
#include <cmath>

namespace nadir::sim {
namespace {
using Eigen::Vector3d;
using geodesy::Geodetic;

TEST(Wgs84Environment, HasTheNormalGravityOfTheEllipsoid) {
  // The harmonic left out, J8 = -1.4e-11, pulls with at most P'_9(1) = 45 times that of g: 6.3e-9 m/s^2.
  const auto& normal = GeographicLib::NormalGravity::WGS84();
  const Environment environment = Environment::wgs84();
  double worst = 0;
  for (const double lat : {-90.0, -60.0, -33.3, 0.0, 20.0, 45.0, 89.999, 90.0})
    for (const double height : {0.0, 3000.0, 100000.0}) {
      const auto p = geodesy::ecef_from_geodetic(Geodetic::degrees(lat, 37, height));
      Vector3d expected;
      normal.U(p.xyz.x(), p.xyz.y(), p.xyz.z(), expected.x(), expected.y(), expected.z());
      worst = std::max(worst, (environment.at(p).gravity_ecef_mps2 - expected).norm());
    }
  EXPECT_LT(worst, 1e-8);
  EXPECT_GT(worst, 1e-9) << "these places no longer exercise the bound";
}

TEST(Wgs84Environment, HasThePublishedGravityAtEquatorAndPoleAndLosesItWithHeight) {
  const Environment environment = Environment::wgs84();
  const auto gravity = [&](double lat_deg, double height_m) {
    return environment.at(geodesy::ecef_from_geodetic(Geodetic::degrees(lat_deg, -120, height_m)))
        .gravity_ecef_mps2.norm();
  };
  // NGA.STND.0036, 2014, table 3.6: theoretical gravity at the equator and at the pole; J8 moves them by up to 6.3e-9.
  EXPECT_NEAR(gravity(0, 0), 9.7803253359, 1e-8);
  EXPECT_NEAR(gravity(90, 0), 9.8321849379, 1e-8);
  EXPECT_NEAR(gravity(-90, 0), 9.8321849379, 1e-8);
  // Between them Somigliana's closed form (4-1 there), and above it the series (4-3), whose gradient leaves out terms
  // of f^2 = 1.1e-5: some three of them in 3e-6/s^2.
  constexpr double a = 6378137, b = 6356752.3142, f = 1 / 298.257223563, m = 0.00344978650684;
  for (const double lat_deg : {0.0, 15.0, 38.1, 45.0, 72.0, 90.0})
    for (const double h : {0.0, 300.0, 3000.0}) {
      const double s2 = std::pow(std::sin(geodesy::to_radians(lat_deg)), 2);
      const double k = b * 9.8321849379 / (a * 9.7803253359) - 1;
      const double surface = 9.7803253359 * (1 + k * s2) / std::sqrt(1 - (1 - b * b / (a * a)) * s2);
      const double series = surface * (1 - 2 / a * (1 + f + m - 2 * f * s2) * h + 3 / (a * a) * h * h);
      EXPECT_NEAR(gravity(lat_deg, h), series, 1e-8 + 1e-10 * h) << lat_deg << " degrees, " << h << " m";
    }
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

TEST(Wgs84Environment, TakesTheAirOfTheDay) {
  const auto p = geodesy::ecef_from_geodetic(Geodetic::degrees(38, 0, 0));
  const Environment warm = Environment::wgs84(0, Atmosphere({.temperature_k = 20}));
  EXPECT_NEAR(warm.at(p).density_kgpm3, 1.225 * 288.15 / 308.15, 1e-5);
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

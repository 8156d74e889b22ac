#include "nadir/geodesy/frames.h"

#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>

#include "nadir/geodesy/geodetic.h"

namespace nadir::geodesy {
namespace {

// Semi-axes of WGS-84: a by definition, b = a (1 - f).
constexpr double a_m = 6378137.0, b_m = 6356752.314245179;

TEST(Ecef, AxesAreWhereWgs84PutsThem) {
  EXPECT_NEAR((ecef_from_geodetic(Geodetic::degrees(0, 0, 0)).xyz - Eigen::Vector3d(a_m, 0, 0)).norm(), 0, 1e-8);
  EXPECT_NEAR((ecef_from_geodetic(Geodetic::degrees(0, 90, 100)).xyz - Eigen::Vector3d(0, a_m + 100, 0)).norm(), 0,
              1e-8);
  EXPECT_NEAR((ecef_from_geodetic(Geodetic::degrees(90, 0, 7)).xyz - Eigen::Vector3d(0, 0, b_m + 7)).norm(), 0, 1e-8);
  EXPECT_NEAR((ecef_from_geodetic(Geodetic::degrees(0, -90, 0)).xyz - Eigen::Vector3d(0, -a_m, 0)).norm(), 0, 1e-8)
      << "west is negative";
}

TEST(Ecef, ComesBackFromEverywhere) {
  for (const double lat : {-90.0, -45.0, -1e-9, 0.3516, 60.0, 89.999999, 90.0})
    for (const double lon : {-179.999, -0.76, 0.0, 32.5896, 180.0})
      for (const double height : {-400.0, 0.0, 1e4, 3.6e7}) {
        const auto point = ecef_from_geodetic(Geodetic::degrees(lat, lon, height));
        const auto again = ecef_from_geodetic(geodetic_from_ecef(point));
        EXPECT_NEAR((again.xyz - point.xyz).norm(), 0, 2e-8) << lat << " " << lon << " " << height;
      }
}

TEST(LocalFrame, AgreesWithAnIndependentImplementation) {
  const LocalFrame local(Geodetic::degrees(38.1, -0.76, 120));
  const GeographicLib::LocalCartesian other(38.1, -0.76, 120);
  for (const auto& [lat, lon, height] : {std::tuple(38.2, -0.7, 0.0), {38.0, -0.9, 3000.0}, {-12.0, 100.0, 5.0}}) {
    Eigen::Vector3d expected;
    other.Forward(lat, lon, height, expected.x(), expected.y(), expected.z());
    const auto p_enu = local.enu_from_ecef() * ecef_from_geodetic(Geodetic::degrees(lat, lon, height));
    EXPECT_NEAR((p_enu.xyz - expected).norm(), 0, 1e-7);
  }
}

TEST(LocalFrame, EastIsEastAndNorthIsNorthOnBothHemispheres) {
  for (const double lat : {60.0, -60.0}) {
    const LocalFrame local(Geodetic::degrees(lat, 20, 0));
    const auto east = local.enu_from_ecef() * ecef_from_geodetic(Geodetic::degrees(lat, 20.001, 0));
    const auto north = local.enu_from_ecef() * ecef_from_geodetic(Geodetic::degrees(lat + 0.001, 20, 0));
    const auto up = local.enu_from_ecef() * ecef_from_geodetic(Geodetic::degrees(lat, 20, 10));
    EXPECT_GT(east.xyz.x(), 50);
    EXPECT_GT(north.xyz.y(), 100);
    EXPECT_NEAR((up.xyz - Eigen::Vector3d(0, 0, 10)).norm(), 0, 1e-8);
  }
}

TEST(Ned, SwapsAxesAndIsItsOwnInverse) {
  const Direction<frame::Enu> d = enu_from_ned() * Direction<frame::Ned>{{1, 2, 3}};
  EXPECT_NEAR((d.xyz - Eigen::Vector3d(2, 1, -3)).norm(), 0, 1e-15);
  const auto place = Geodetic::degrees(47, -99, 500);
  const Point<frame::Ecef> below = ecef_from_ned(place) * Point<frame::Ned>{{0, 0, 500}};
  EXPECT_NEAR(geodetic_from_ecef(below).height_m, 0, 1e-8) << "down is down";
}

TEST(Pose, InverseAndProductAgree) {
  const Pose<frame::Enu, frame::Body> enu_from_body{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {10, -20, 30}};
  const Pose<frame::Body, frame::Camera> body_from_camera{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())), {1, 2, 3}};
  const Point<frame::Camera> p{{4, 5, 6}};
  const Point<frame::Enu> one = (enu_from_body * body_from_camera) * p, two = enu_from_body * (body_from_camera * p);
  EXPECT_NEAR((one.xyz - two.xyz).norm(), 0, 1e-13);
  EXPECT_NEAR(((enu_from_body.inverse() * two).xyz - (body_from_camera * p).xyz).norm(), 0, 1e-13);
}

}  // namespace
}  // namespace nadir::geodesy

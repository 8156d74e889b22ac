#include "nadir/render/truth_planes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nadir::render {
namespace {

using namespace geodesy;

ExactChain chain_over(const Surface& surface, double height_m, double pitch_deg) {
  Geodetic place = surface.frame().origin();
  place.height_m = height_m;
  return ExactChain(Camera::pinhole(64, 48, 60, 60, 32, 24).value(),
                    camera_pose(place, YawPitchRoll::degrees(0, pitch_deg, 0)), surface);
}

TEST(TruthPlanes, OfALevelViewOfAPlaneAreThoseOfTriangles) {
  const Geodetic origin = Geodetic::degrees(47, 9, 100);
  const TruthPlanes planes = truth_planes(chain_over(Plane(origin, 100), 400, 0), 1);
  ASSERT_EQ(planes.range_m.size(), 64u * 48);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const auto at = static_cast<std::size_t>(y * 64 + x);
      const double aside_m = 300 * std::hypot(x + 0.5 - 32, y + 0.5 - 24) / 60;
      EXPECT_NEAR(planes.range_m[at], std::hypot(300, aside_m), 1e-4);
      EXPECT_NEAR(planes.incidence_deg[at], to_degrees(std::atan2(aside_m, 300)), 1e-4);
      EXPECT_NEAR(planes.ground_sample_distance_m[at], 5, 1e-5);
      EXPECT_NEAR(planes.height_m[at], 100, 0.01) << "the plane leaves the ellipsoid by 4 mm there";
    }
  // The middle is where the camera is; north is up
  const std::size_t middle = 24 * 64 + 32;
  EXPECT_NEAR(planes.latitude_deg[middle], 47, 5e-5);
  EXPECT_GT(planes.latitude_deg[0], planes.latitude_deg[47 * 64]);
  EXPECT_LT(planes.longitude_deg[0], planes.longitude_deg[63]);
}

TEST(TruthPlanes, OnTheCurvedEarthKeepTheirHeightAndSteepenTowardsTheHorizon) {
  const Geodetic origin = Geodetic::degrees(-30, 120, 0);
  const TruthPlanes planes = truth_planes(chain_over(Ellipsoid(origin, 250), 400e3, 75), 2);
  int ground = 0;
  for (std::size_t i = 0; i < planes.height_m.size(); ++i) {
    if (std::isnan(planes.range_m[i])) {
      EXPECT_TRUE(std::isnan(planes.latitude_deg[i]) && std::isnan(planes.incidence_deg[i]));
      continue;
    }
    ++ground;
    EXPECT_NEAR(planes.height_m[i], 250, 1e-3);
    EXPECT_GE(planes.incidence_deg[i], 0);
    EXPECT_LT(planes.incidence_deg[i], 90);
    // The tangent from 400 km above a sphere of that curvature is 2290 km long
    EXPECT_LT(planes.range_m[i], 2.4e6);
  }
  EXPECT_GT(ground, 500);
  EXPECT_LT(ground, 64 * 48) << "and there is sky";
  EXPECT_GT(planes.incidence_deg[static_cast<std::size_t>(34 * 64 + 32)],
            planes.incidence_deg[static_cast<std::size_t>(47 * 64 + 32)]);
}

TEST(TruthPlanes, AreTheSameForAnyThreads) {
  const ExactChain chain = chain_over(Ellipsoid(Geodetic::degrees(0, 0, 0), 0), 1000, 75);
  const TruthPlanes one = truth_planes(chain, 1);
  ASSERT_TRUE(std::isnan(one.range_m.front())) << "NaN is there to be compared";
  EXPECT_TRUE(one == truth_planes(chain, 2));
  for (auto plane : {&TruthPlanes::height_m, &TruthPlanes::ground_sample_distance_m}) {
    TruthPlanes other = one;
    (other.*plane).back() = std::nextafter((other.*plane).back(), HUGE_VALF);
    EXPECT_FALSE(one == other);
  }
}

}  // namespace
}  // namespace nadir::render

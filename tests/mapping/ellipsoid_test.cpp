#include "nadir/render/ellipsoid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace nadir::render {
namespace {

using namespace geodesy;
using Vector = Eigen::Matrix<long double, 3, 1>;

/// Height above the WGS-84 ellipsoid, by Newton's steps in 64 bits of mantissa.
long double height_of(const Vector& p) {
  constexpr long double a = 6378137, f = 1 / 298.257223563L, e2 = f * (2 - f);
  const long double r = std::hypot(p.x(), p.y());
  long double lat = std::atan2(p.z(), r * (1 - e2)), height = 0;
  for (int i = 0; i < 60; ++i) {
    const long double s = std::sin(lat), n = a / std::sqrt(1 - e2 * s * s);
    height = r * std::cos(lat) + p.z() * s - a * a / n;
    lat = std::atan2(p.z() + e2 * n * s, r);
  }
  return height;
}

/// The first place along a unit ray at `height_m`, by halving between the camera and where the ray is nearest to the
/// Earth's centre.
long double distance_to(const Vector& from, const Vector& ray, long double height_m) {
  long double above = 0, below = -from.dot(ray);
  for (int i = 0; i < 120; ++i) {
    const long double middle = (above + below) / 2;
    (height_of(from + middle * ray) > height_m ? above : below) = middle;
  }
  return above;
}

TEST(Ellipsoid, IsHitWhereExtendedPrecisionSays) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  int hits = 0;
  for (const double height_m : {0.0, -430.0, 8800.0})
    for (const double above_m : {0.01, 1.0, 300.0, 20e3, 400e3, 36e6})
      for (int i = 0; i < 60; ++i) {
        const Geodetic place = Geodetic::degrees(180 * unit(random) - 90, 360 * unit(random) - 180, height_m + above_m);
        const auto from = ecef_from_geodetic(place);
        const double down = std::acos(unit(random)), turn = 2 * M_PI * unit(random);
        const Direction<frame::Ned> ned{
            {std::sin(down) * std::cos(turn), std::sin(down) * std::sin(turn), std::cos(down)}};
        const Eigen::Vector3d ray = (ecef_from_ned(place).rotation * ned.xyz).normalized();
        const auto hit = Ellipsoid(place, height_m).hit(from, {ray});
        const Vector origin = from.xyz.cast<long double>(), direction = ray.cast<long double>();
        const long double nearest = -origin.dot(direction);
        const bool misses = height_of(origin + nearest * direction) > height_m;
        if (misses) {
          EXPECT_FALSE(hit && height_of(hit->xyz.cast<long double>()) > height_m + 1e-6L);
          continue;
        }
        if (!hit) continue;  // grazing
        const long double distance = distance_to(origin, direction, height_m);
        const Vector expected = origin + distance * direction;
        const Vector normal = expected.normalized();
        const double sine = static_cast<double>(-normal.dot(direction));
        if (sine < 1e-3) continue;
        EXPECT_LT(static_cast<double>((hit->xyz.cast<long double>() - expected).norm()),
                  (3e-8 + 1e-15 * above_m) / sine)
            << height_m << " + " << above_m << ", " << down;
        ++hits;
      }
  EXPECT_GT(hits, 500);
}

TEST(Ellipsoid, IsNotSeenFromBelowFromItselfOrUpwards) {
  const Geodetic place = Geodetic::degrees(31.5, 35.5, -430);  // on the Dead Sea's shore
  const auto from = ecef_from_geodetic(place);
  const Eigen::Vector3d down = ecef_from_ned(place).rotation * Eigen::Vector3d::UnitZ();
  EXPECT_FALSE(Ellipsoid(place, 0).hit(from, {down})) << "below";
  EXPECT_FALSE(Ellipsoid(place, -430).hit(from, {down})) << "on it";
  EXPECT_FALSE(Ellipsoid(place, -440).hit(from, {-down})) << "away";
  const auto hit = Ellipsoid(place, -440).hit(from, {down});
  ASSERT_TRUE(hit);
  EXPECT_NEAR((hit->xyz - from.xyz).norm(), 10, 1e-8);
}

}  // namespace
}  // namespace nadir::render

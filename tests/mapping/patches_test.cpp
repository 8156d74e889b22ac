#include "nadir/render/patches.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "every_pixel.h"

namespace nadir::render {
namespace {

using geodesy::Geodetic, geodesy::Projection, geodesy::YawPitchRoll;

struct View {
  const char* crs;
  double lat_deg, lon_deg, height_m, yaw_deg, pitch_deg, roll_deg;
};

ExactChain chain_of(const View& view, int width = 640, int height = 480, double focal_px = 500) {
  const Geodetic origin = Geodetic::degrees(view.lat_deg, view.lon_deg, 0);
  Geodetic place = origin;
  place.height_m = view.height_m;
  return ExactChain(Camera::pinhole(width, height, focal_px, focal_px, width * 0.5, height * 0.5).value(),
                    camera_pose(place, YawPitchRoll::degrees(view.yaw_deg, view.pitch_deg, view.roll_deg)),
                    Plane(origin, 0));
}

std::vector<Lens> some_lenses() {
  const std::vector<double> barrel = {-0.28, 0.07, 0.0008, -0.0005, 0}, pincushion = {0.2, 0.05, -0.001, 0.002, 0.01},
                            rational = {0.3, 0.1, 0.0005, -0.0005, 0.01, 0.5, 0.2, 0.02},
                            fisheye = {0.01, -0.003, 0.0005, 0};
  return {Lens(), Lens::make(LensModel::plumb_bob, barrel).value(),
          Lens::make(LensModel::plumb_bob, pincushion).value(),
          Lens::make(LensModel::rational_polynomial, rational).value(),
          Lens::make(LensModel::equidistant, fisheye).value()};
}

TEST(Patches, KeepTheToleranceThroughLensesAndOnTheCurvedEarth) {
  constexpr int width = 128, height = 96;
  constexpr double tolerance = 0.05;
  double worst_px = 0;
  std::array<std::int64_t, 5> kinds{};
  for (const double height_m : {1.0, 100.0, 12e3, 400e3, 36e6})
    for (const double pitch_deg : {0.0, 50.0, 87.0, 130.0})
      for (const Lens& lens : some_lenses()) {
        const Geodetic origin = Geodetic::degrees(47, 9, 0);
        Geodetic place = origin;
        place.height_m = height_m;
        const Camera camera = Camera::pinhole(width, height, 80, 80, width * 0.5, height * 0.5).value().with_lens(lens);
        const auto pose = camera_pose(place, YawPitchRoll::degrees(30, pitch_deg, 10));
        for (const Surface& surface : {Surface(Plane(origin, 0)), Surface(Ellipsoid(origin, 0))}) {
          const ExactChain chain(camera, pose, surface);
          const auto projection = Projection::from_definition("EPSG:4326").value();
          const PatchMapping mapping = map_patches(chain, projection, tolerance, {});
          const Outcome outcome = check_every_pixel(chain, projection, mapping);
          EXPECT_LE(outcome.worst_px, tolerance) << height_m << " m, pitch " << pitch_deg;
          worst_px = std::max(worst_px, outcome.worst_px);
          std::int64_t total = 0;
          for (std::size_t k = 0; k < kinds.size(); ++k) {
            kinds[k] += outcome.pixels[k];
            total += outcome.pixels[k];
          }
          EXPECT_EQ(total, width * height);
        }
      }
  EXPECT_GT(worst_px, 0.3 * tolerance) << "these views no longer exercise the bound";
  for (const auto kind :
       {Patch::Kind::Homography, Patch::Kind::Biquadratic, Patch::Kind::PerPixel, Patch::Kind::NoGround})
    EXPECT_GT(kinds[static_cast<std::size_t>(kind)], 0) << static_cast<int>(kind);
}

TEST(Patches, KeepTheToleranceAtTheExtremes) {
  struct Extreme {
    const char* what;
    int width, height;
    double fx, fy, height_m, lat_deg, lon_deg, pitch_deg, roll_deg;
  };
  constexpr double micro_rad_deg = 180e-6 / 3.14159265358979;
  const Extreme extremes[] = {
      {"one pixel", 1, 1, 500, 500, 100, 10, 20, 0, 0},
      {"a thousandth of a degree", 64, 48, 4e6, 4e6, 300, 10, 20, 30, 0},
      {"179.9 degrees", 64, 48, 0.028, 0.028, 300, 10, 20, 0, 0},
      {"179.9 degrees, aside", 64, 48, 0.028, 0.028, 300, 10, 20, 80, 0},
      {"focal lengths 1e6 apart", 64, 48, 1e5, 0.1, 300, 10, 20, 10, 0},
      {"1 cm above the ground", 64, 48, 60, 60, 0.01, 10, 20, 20, 0},
      {"36,000 km above it", 64, 48, 300, 300, 36e6, 10, 20, 0, 0},
      {"a microradian below the horizon", 64, 48, 1e4, 1e4, 1000, 10, 20, 90 - micro_rad_deg, 0},
      {"straight up", 64, 48, 60, 60, 100, 10, 20, 180, 0},
      {"upside down", 64, 48, 60, 60, 100, 10, 20, 60, 180},
      {"level, on its side", 64, 48, 60, 60, 100, 10, 20, 90, 90},
      {"the north pole", 64, 48, 60, 60, 5000, 90, 0, 10, 0},
      {"the south pole", 64, 48, 60, 60, 5000, -90, 0, 10, 0},
      {"the antimeridian", 64, 48, 60, 60, 5000, 10, 180, 10, 0},
      {"below the ground", 64, 48, 60, 60, -3, 10, 20, 0, 0},
  };
  for (const Extreme& e : extremes)
    for (const char* crs : {"EPSG:4326", "EPSG:32634", "EPSG:3413", "EPSG:3031", "EPSG:3857"}) {
      const Geodetic origin = Geodetic::degrees(e.lat_deg, e.lon_deg, 0);
      Geodetic place = origin;
      place.height_m = e.height_m;
      const Camera camera = Camera::pinhole(e.width, e.height, e.fx, e.fy, e.width * 0.5, e.height * 0.5).value();
      const auto pose = camera_pose(place, YawPitchRoll::degrees(15, e.pitch_deg, e.roll_deg));
      const auto projection = Projection::from_definition(crs).value();
      for (const Surface& surface : {Surface(Plane(origin, 0)), Surface(Ellipsoid(origin, 0))}) {
        const ExactChain chain(camera, pose, surface);
        const Outcome outcome = check_every_pixel(chain, projection, map_patches(chain, projection, 0.05, {}));
        EXPECT_LE(outcome.worst_px, 0.05) << e.what << ", " << crs << (surface.plane() ? ", plane" : ", ellipsoid");
      }
    }
}

TEST(Look, IsRightWhereItIsCertain) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  std::array<int, 3> found{};
  for (const Lens& lens : some_lenses())
    for (const double height_m : {2.0, 900.0, 400e3, 36e6})
      for (int i = 0; i < 60; ++i) {
        const Geodetic origin = Geodetic::degrees(-20, 170, 0);
        Geodetic place = origin;
        place.height_m = height_m;
        const auto pose =
            camera_pose(place, YawPitchRoll::degrees(360 * unit(random), 180 * unit(random), 20 * unit(random)));
        const Camera camera = Camera::pinhole(400, 300, 200, 200, 200, 150).value().with_lens(lens);
        for (const Surface& surface : {Surface(Plane(origin, 0)), Surface(Ellipsoid(origin, 0))}) {
          const ExactChain chain(camera, pose, surface);
          const Eigen::Vector2d corner(300 * unit(random), 200 * unit(random)),
              size(1 + 99 * unit(random), 1 + 99 * unit(random));
          const Sight sight = chain.look({corner, corner + size});
          ++found[static_cast<std::size_t>(sight)];
          if (sight == Sight::Some) continue;
          for (int k = 0; k < 100; ++k) {
            const Eigen::Vector2d at = corner + size.cwiseProduct(Eigen::Vector2d(unit(random), unit(random)));
            EXPECT_EQ(chain.enu_from_image(at).has_value(), sight == Sight::All)
                << at.transpose() << " through " << to_string(lens.model()) << " from " << height_m << " m";
          }
        }
      }
  for (const int n : found) EXPECT_GT(n, 50);
}

TEST(GroundExtent, OfTheCurvedEarthHoldsTheMapAndLeavesOutWhatIsFar) {
  const Geodetic origin = Geodetic::degrees(10, 179.9, 0);
  const Surface earth = Ellipsoid(origin, 0);
  auto projection = Projection::from_definition("EPSG:4326").value();
  projection.wrap_around(180);
  // Across the antimeridian: 179.5 to 180.5 degrees
  Eigen::Affine2d crs_from_texel = Eigen::Affine2d::Identity();
  crs_from_texel.matrix() << 0.01, 0, 179.5, 0, -0.01, 10.5, 0, 0, 1;
  const GroundExtent extent = ground_extent(earth, projection, crs_from_texel, 100, 100);
  ASSERT_TRUE(extent.bounded);
  EXPECT_LT(extent.radius_rad, 0.014);
  EXPECT_GT(extent.radius_rad, 0.012);
  const auto kinds_seen_from = [&](double lon_deg) {
    const auto pose = camera_pose(Geodetic::degrees(10, lon_deg, 5000), YawPitchRoll::degrees(0, 0, 0));
    const ExactChain chain(Camera::pinhole(200, 200, 200, 200, 100, 100).value(), pose, earth);
    return map_patches(chain, projection, 0.05, {extent}).patches.front().kind;
  };
  EXPECT_NE(kinds_seen_from(-179.6), Patch::Kind::OffMap);
  EXPECT_NE(kinds_seen_from(179.6), Patch::Kind::OffMap);
  EXPECT_EQ(kinds_seen_from(178), Patch::Kind::OffMap);
  EXPECT_EQ(kinds_seen_from(-178), Patch::Kind::OffMap);
}

TEST(Patches, KeepTheToleranceAtEveryPixel) {
  const View views[] = {{"EPSG:4326", 38.1, -0.76, 3000, 20, 0, 0}, {"EPSG:4326", 70, 30, 20000, 200, 60, 10},
                        {"EPSG:3857", 60, 10, 8000, 77, 45, -20},   {"EPSG:32614", 47, -99, 12000, 300, 65, 0},
                        {"EPSG:32614", 47, -95, 50000, 10, 20, 30}, {"EPSG:3031", -80, 100, 30000, 0, 50, 0},
                        {"EPSG:26914", 47, -99, 100, 45, 85, 5}};
  double worst_of_all = 0;
  for (const double tolerance : {1.0, 0.05, 1e-3})
    for (const View& view : views) {
      const auto projection = Projection::from_definition(view.crs).value();
      const ExactChain chain = chain_of(view);
      const PatchMapping mapping = map_patches(chain, projection, tolerance, {});
      const Outcome outcome = check_every_pixel(chain, projection, mapping);
      EXPECT_LE(outcome.worst_px, tolerance) << view.crs << " pitch " << view.pitch_deg;
      std::int64_t total = 0;
      for (const auto n : outcome.pixels) total += n;
      EXPECT_EQ(total, 640 * 480) << "patches tile the image";
      worst_of_all = std::max(worst_of_all, outcome.worst_px / tolerance);
    }
  EXPECT_GE(worst_of_all, 0.3) << "these views no longer exercise the bound";
}

TEST(Patches, ASmallLevelViewIsOneHomographyWithThirteenExactPoints) {
  const auto projection = Projection::from_definition("EPSG:32614").value();
  const PatchMapping mapping = map_patches(chain_of({"", 47, -99, 300, 20, 0, 0}), projection, 0.05, {});
  ASSERT_EQ(mapping.patches.size(), 1u);
  EXPECT_EQ(mapping.patches[0].kind, Patch::Kind::Homography);
  EXPECT_EQ(mapping.exact_points, 13);
}

TEST(Patches, TheHorizonSplitsGroundFromSkyAtTheRightPixel) {
  // Looking at the horizon: pitch 90 puts the optical axis level, so rows above the middle see sky.
  const ExactChain chain = chain_of({"", 10, 20, 100, 0, 90, 0});
  const auto projection = Projection::from_definition("EPSG:4326").value();
  const PatchMapping mapping = map_patches(chain, projection, 0.05, {});
  for (const Patch& patch : mapping.patches) {
    if (patch.kind == Patch::Kind::NoGround) {
      EXPECT_LE(patch.rect.y + patch.rect.height, 248) << "within a smallest patch of row 240";
    } else if (patch.kind == Patch::Kind::Homography || patch.kind == Patch::Kind::Biquadratic) {
      EXPECT_GE(patch.rect.y, 240);
    } else {
      ASSERT_EQ(patch.kind, Patch::Kind::PerPixel);
      for (int y = 0; y < patch.rect.height; ++y)
        for (int x = 0; x < patch.rect.width; ++x)
          EXPECT_TRUE(patch.rect.y + y >= 240 ||
                      !patch.crs[static_cast<std::size_t>(y * patch.rect.width + x)].allFinite());
    }
  }
}

TEST(Patches, ACameraBelowThePlaneOrLookingUpSeesNoGround) {
  const auto projection = Projection::from_definition("EPSG:4326").value();
  for (const View& view :
       {View{"", 10, 20, -5, 0, 0, 0}, View{"", 10, 20, 0, 0, 0, 0}, View{"", 10, 20, 500, 0, 180, 0}}) {
    const PatchMapping mapping = map_patches(chain_of(view), projection, 0.05, {});
    ASSERT_EQ(mapping.patches.size(), 1u);
    EXPECT_EQ(mapping.patches[0].kind, Patch::Kind::NoGround);
    EXPECT_EQ(mapping.exact_points, 0);
  }
}

TEST(Patches, WhatSeesNoMapIsNotMapped) {
  const auto projection = Projection::from_definition("EPSG:32614").value();
  const ExactChain chain = chain_of({"", 47, -99, 300, 0, 0, 0});
  GroundExtent everywhere, far;
  everywhere.bounded = false;
  far.box = Eigen::AlignedBox2d(Eigen::Vector2d(5000, 5000), Eigen::Vector2d(6000, 6000));
  GroundExtent near;
  near.box = Eigen::AlignedBox2d(Eigen::Vector2d(-10, -10), Eigen::Vector2d(10, 10));
  EXPECT_EQ(map_patches(chain, projection, 0.05, {far}).patches.at(0).kind, Patch::Kind::OffMap);
  EXPECT_EQ(map_patches(chain, projection, 0.05, {far}).exact_points, 0);
  EXPECT_EQ(map_patches(chain, projection, 0.05, {far, near}).patches.at(0).kind, Patch::Kind::Homography);
  EXPECT_EQ(map_patches(chain, projection, 0.05, {far, everywhere}).patches.at(0).kind, Patch::Kind::Homography)
      << "an extent without bound is never left out";
}

TEST(Patches, AcrossTheAntimeridianAPatchNeverSpansTheWorld) {
  auto projection = Projection::from_definition("EPSG:4326").value();
  projection.wrap_around(0);  // a map of the world: longitudes jump at 180
  const ExactChain chain = chain_of({"", 10, 180, 20000, 30, 0, 0});
  const PatchMapping mapping = map_patches(chain, projection, 0.05, {});
  EXPECT_LE(check_every_pixel(chain, projection, mapping).worst_px, 0.05);
  for (const Patch& patch : mapping.patches)
    if (patch.kind == Patch::Kind::Homography) {
      const Eigen::Vector2d far = apply(patch.crs_from_image, Eigen::Vector2d(patch.rect.width, patch.rect.height));
      EXPECT_LT(far.norm(), 1.0) << "degrees";
    }
}

TEST(GroundExtent, HoldsTheMap) {
  const Plane plane(Geodetic::degrees(47, -99, 0), 0);
  const auto projection = Projection::from_definition("EPSG:4326").value();
  const Eigen::Affine2d crs_from_texel = Eigen::Translation2d(-99.1, 47.1) * Eigen::Scaling(0.001, -0.001);
  const GroundExtent extent = ground_extent(plane, projection, crs_from_texel, 200, 200);
  ASSERT_TRUE(extent.bounded);
  // 0.1 degrees: 7.6 km east, 11.1 km north at this latitude
  EXPECT_NEAR(extent.box.max().x(), 7600, 250);
  EXPECT_NEAR(extent.box.min().y(), -11120, 350);
  EXPECT_FALSE(ground_extent(plane, projection,
                             Eigen::Translation2d(-180, 90) * Eigen::Affine2d(Eigen::Scaling(1.0, -1.0)), 360, 180)
                   .bounded)
      << "no plane reaches around the world";
}

}  // namespace
}  // namespace nadir::render

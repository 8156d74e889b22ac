#include "nadir/render/level_of_detail.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nadir::render {
namespace {

std::vector<tile::Level> levels_of(std::initializer_list<double> texels) {
  std::vector<tile::Level> levels;
  for (const double t : texels) levels.push_back({1000, 1000, t, t});
  return levels;
}

TEST(Log2, IsWithinItsBound) {
  double worst = 0;
  for (double x = 1e-6; x < 1e9; x *= 1.0003) worst = std::max(worst, std::abs(log2_portable(x) - std::log2(x)));
  EXPECT_LE(worst, 2e-7);
  EXPECT_GE(worst, 1e-8) << "these arguments no longer exercise the bound";
  EXPECT_EQ(log2_portable(1), 0);
  EXPECT_EQ(log2_portable(8), 3) << "powers of two are exact";
}

TEST(LevelCoordinate, FollowsTheFilesLevels) {
  const auto halves = levels_of({1, 2, 4, 8});
  EXPECT_EQ(level_coordinate(halves, 0.1), 0) << "nothing is finer than level 0";
  EXPECT_EQ(level_coordinate(halves, 1), 0);
  EXPECT_NEAR(level_coordinate(halves, std::sqrt(8)), 1.5, 1e-6) << "half-way between levels 1 and 2";
  EXPECT_EQ(level_coordinate(halves, 1e9), 3) << "nothing is coarser than the coarsest";
  const auto uneven = levels_of({1, 3, 12});
  EXPECT_NEAR(level_coordinate(uneven, 6), 1.5, 1e-6);
  EXPECT_EQ(level_coordinate(levels_of({1}), 50), 0);
}

Eigen::Matrix2d turned(double angle, double along, double across) {
  return Eigen::Rotation2Dd(angle).toRotationMatrix() * Eigen::Vector2d(along, across).asDiagonal();
}

TEST(FootprintSamples, EachSampleStandsForTheShorterAxis) {
  for (const double angle : {0.0, 0.3, 1.2}) {
    const SamplePattern p = footprint_samples(turned(angle, 12, 3), 1, 16, 1e9);
    EXPECT_NEAR(p.texels, 3, 1e-12);
    EXPECT_NEAR(p.samples_x, 4, 1e-12);
    EXPECT_NEAR(p.samples_y, 1, 1e-12);
  }
  EXPECT_NEAR(footprint_samples(turned(0, 12, 3), 2, 16, 1e9).samples_x, 8, 1e-12);
  EXPECT_NEAR(footprint_samples(turned(0, 300, 3), 1, 16, 1e9).texels, 300.0 / 16, 1e-12)
      << "beyond 16 to 1 the footprint is blurred";
}

TEST(FootprintSamples, NeedNoMoreThanOneWhenZoomedIn) {
  const SamplePattern p = footprint_samples(turned(0.5, 0.25, 0.2), 1, 16, 1e9);
  EXPECT_LE(p.samples_x, 1);
  EXPECT_LE(p.samples_y, 1);
}

TEST(FootprintSamples, GrowInNumberWhereTheMapLacksLevels) {
  const SamplePattern p = footprint_samples(turned(0, 40, 40), 1, 16, 4);
  EXPECT_EQ(p.texels, 4);
  EXPECT_NEAR(p.samples_x, 10, 1e-12);
}

TEST(FootprintSamples, AFootprintWithoutAreaIsStillDefined) {
  for (const SamplePattern& p :
       {footprint_samples(Eigen::Matrix2d::Zero(), 1, 16, 8), footprint_samples(turned(0.1, 5, 0), 1, 16, 8)}) {
    EXPECT_GT(p.texels, 0);
    EXPECT_TRUE(std::isfinite(p.samples_x) && std::isfinite(p.samples_y));
  }
}

}  // namespace
}  // namespace nadir::render

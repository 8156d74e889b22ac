#include "nadir/render/homography.h"

#include <gtest/gtest.h>

#include <limits>

namespace nadir::render {
namespace {

TEST(Homography, TakesTheRectanglesCornersWhereTheyBelong) {
  const std::array<Eigen::Vector2d, 4> corners = {Eigen::Vector2d(3, 4), {90, -7}, {120, 80}, {-10, 60}};
  const Eigen::Matrix3d h = homography_from_rectangle(640, 480, corners).value();
  EXPECT_NEAR((apply(h, {0, 0}) - corners[0]).norm(), 0, 1e-12);
  EXPECT_NEAR((apply(h, {640, 0}) - corners[1]).norm(), 0, 1e-11);
  EXPECT_NEAR((apply(h, {640, 480}) - corners[2]).norm(), 0, 1e-11);
  EXPECT_NEAR((apply(h, {0, 480}) - corners[3]).norm(), 0, 1e-11);
  EXPECT_EQ(h(2, 2), 1);
  EXPECT_GT(std::abs(h(2, 0)), 1e-6) << "these corners no longer need perspective";
}

TEST(Homography, KeepsMirroredCorners) {
  const std::array<Eigen::Vector2d, 4> mirrored = {Eigen::Vector2d(10, 0), {0, 0}, {0, 10}, {10, 10}};
  const auto h = homography_from_rectangle(10, 10, mirrored);
  ASSERT_TRUE(h);
  EXPECT_NEAR((apply(*h, {2, 3}) - Eigen::Vector2d(8, 3)).norm(), 0, 1e-14);
}

TEST(Homography, RefusesCornersThatAreNotConvexOrHaveNoArea) {
  EXPECT_FALSE(homography_from_rectangle(1, 1, {Eigen::Vector2d(0, 0), {1, 1}, {2, 2}, {3, 3}}));
  EXPECT_FALSE(homography_from_rectangle(1, 1, {Eigen::Vector2d(0, 0), {1, 0}, {0.1, 0.1}, {0, 1}}));
  EXPECT_FALSE(homography_from_rectangle(1, 1, {Eigen::Vector2d(0, 0), {1, 1}, {1, 0}, {0, 1}})) << "a bow tie";
  EXPECT_FALSE(homography_from_rectangle(
      1, 1, {Eigen::Vector2d(0, 0), {1, 0}, {1, std::numeric_limits<double>::quiet_NaN()}, {0, 1}}));
}

TEST(Homography, TheJacobianIsTheDerivative) {
  const Eigen::Matrix3d h =
      homography_from_rectangle(640, 480, {Eigen::Vector2d(3, 4), {90, -7}, {120, 80}, {-10, 60}}).value();
  const Eigen::Vector2d p(200, 300);
  const double step = 1e-4;  // central differences err by step^2 times a third derivative, here below 1e-11
  const Eigen::Matrix2d j = jacobian(h, p);
  EXPECT_NEAR(
      (j.col(0) - (apply(h, p + Eigen::Vector2d(step, 0)) - apply(h, p - Eigen::Vector2d(step, 0))) / (2 * step))
          .norm(),
      0, 1e-9);
  EXPECT_NEAR(
      (j.col(1) - (apply(h, p + Eigen::Vector2d(0, step)) - apply(h, p - Eigen::Vector2d(0, step))) / (2 * step))
          .norm(),
      0, 1e-9);
}

TEST(Homography, TheBorderToCentresAtIntegersShiftsByHalfAPixelOnBothSides) {
  const Eigen::Matrix3d h =
      homography_from_rectangle(640, 480, {Eigen::Vector2d(3, 4), {90, -7}, {120, 80}, {-10, 60}}).value();
  const Eigen::Matrix3d outside = with_centres_at_integers(h);
  const Eigen::Vector2d p(17, 230), half(0.5, 0.5);
  EXPECT_NEAR((apply(outside, p - half) - (apply(h, p) - half)).norm(), 0, 1e-12);
  EXPECT_EQ(outside(2, 2), 1);
}

}  // namespace
}  // namespace nadir::render

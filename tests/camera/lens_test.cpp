#include "nadir/render/lens.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#ifdef NADIR_HAVE_OPENCV_CALIB3D
#include <opencv2/calib3d.hpp>
#endif

namespace nadir::render {
namespace {

constexpr double focal_px = 1000;

Lens lens(LensModel model, std::vector<double> coefficients) { return Lens::make(model, coefficients).value(); }

/// Coefficients as calibrations find them, `size` times.
Lens random_lens(LensModel model, std::mt19937& random, double size) {
  const auto within = [&](double most) { return size * most * std::uniform_real_distribution<double>(-1, 1)(random); };
  std::vector<double> c;
  switch (model) {
    case LensModel::plumb_bob:
      c = {within(0.4), within(0.3), within(0.005), within(0.005), within(0.2)};
      break;
    case LensModel::rational_polynomial:
      c = {within(0.5), within(0.3), within(0.005), within(0.005), within(0.1), within(0.5), within(0.3), within(0.1)};
      break;
    case LensModel::equidistant:
      c = {within(0.1), within(0.05), within(0.02), within(0.005)};
      break;
  }
  return lens(model, c);
}

constexpr LensModel models[] = {LensModel::plumb_bob, LensModel::rational_polynomial, LensModel::equidistant};

TEST(Lens, WithoutCoefficientsLeavesPointsWhereAPinholeHasThem) {
  const Lens ideal;
  EXPECT_TRUE(ideal.ideal());
  EXPECT_EQ(*ideal.image_of({3, -4, 2}), Eigen::Vector2d(1.5, -2));
  EXPECT_FALSE(ideal.image_of({0, 0, 0}));
  EXPECT_FALSE(ideal.image_of({0, 0, -1}));
  EXPECT_FALSE(lens(LensModel::equidistant, {}).ideal()) << "it is not a pinhole's";
}

TEST(Lens, ComesBackToTheRayWhereverItHasAnImage) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  int looked_at = 0;
  for (int i = 0; i < 3000; ++i) {
    const LensModel model = models[i % 3];
    const Lens l = random_lens(model, random, i % 2 == 0 ? 1.0 : 0.1);
    const double reach = model == LensModel::equidistant ? 1.6 : 1.2;
    const Eigen::Vector3d ray(reach * unit(random), reach * unit(random), 1);
    const auto image = l.image_of(ray);
    if (!image) continue;
    const auto back = l.ray_of(*image);
    const auto again = back ? l.image_of(*back) : std::nullopt;
    ASSERT_TRUE(again) << i;
    EXPECT_LT((*again - *image).norm() * focal_px, 1e-9 * (1 + image->norm())) << i;
    // The ray itself, but where the lens is about to fold and many rays have nearly one image
    constexpr double step = 1e-6;
    const auto beside = l.image_of(ray + Eigen::Vector3d(step, 0, 0)),
               below = l.image_of(ray + Eigen::Vector3d(0, step, 0));
    if (!beside || !below) continue;
    Eigen::Matrix2d slope;
    slope << *beside - *image, *below - *image;
    if (slope.jacobiSvd().singularValues().minCoeff() < 0.05 * step) continue;
    EXPECT_LT((back->normalized() - ray.normalized()).norm(), 1e-11) << i;
    ++looked_at;
  }
  EXPECT_GT(looked_at, 1500);
}

TEST(Lens, IsValidUpToWhereItsRadialPartTurns) {
  // r (1 - r^2 / 3) has its greatest value, 2/3, at 1
  const Lens barrel = lens(LensModel::plumb_bob, {-1.0 / 3});
  EXPECT_NEAR(barrel.valid_radius(), 1, 1e-14);
  EXPECT_TRUE(barrel.image_of({0.999, 0, 1}));
  EXPECT_FALSE(barrel.image_of({1.001, 0, 1}));
  EXPECT_TRUE(barrel.ray_of({0.666, 0}));
  EXPECT_FALSE(barrel.ray_of({0.667, 0})) << "no ray comes so far out";
  // It turns, and turns again: 1 - 3 s + s^2 from s = (3 - sqrt(5)) / 2 on
  const Lens wave = lens(LensModel::plumb_bob, {-1, 0.2});
  EXPECT_NEAR(wave.valid_radius(), std::sqrt((3 - std::sqrt(5)) / 2), 1e-12);
  EXPECT_TRUE(std::isinf(lens(LensModel::plumb_bob, {0.3, 0.1}).valid_radius()));
  // A pole: 1 - s / 4 vanishes at 2
  const Lens pole = lens(LensModel::rational_polynomial, {0, 0, 0, 0, 0, -0.25});
  EXPECT_NEAR(pole.valid_radius(), 2, 1e-12);
  EXPECT_TRUE(pole.image_of({1.99, 0, 1}));
  EXPECT_FALSE(pole.image_of({2.01, 0, 1}));
  EXPECT_EQ(lens(LensModel::equidistant, {}).valid_radius(), std::numbers::pi);
  EXPECT_NEAR(lens(LensModel::equidistant, {-1.0 / 3}).valid_radius(), 1, 1e-14);
}

TEST(Lens, NeverFolds) {
  // Along a line from the axis outward images move outward, until there are none
  std::mt19937 random(2);
  std::uniform_real_distribution<double> turn(0, 2 * std::numbers::pi);
  for (int i = 0; i < 600; ++i) {
    const LensModel model = models[i % 3];
    const Lens l = random_lens(model, random, 5);
    const double angle = turn(random);
    double before = -1;
    for (double r = 0; r < 3; r += 0.01) {
      const auto image = l.image_of({r * std::cos(angle), r * std::sin(angle), 1});
      if (!image) break;
      if (model == LensModel::equidistant) {
        EXPECT_GT(image->norm(), before) << i;
      }
      before = image->norm();
      const auto back = l.ray_of(*image);
      ASSERT_TRUE(!back || (*l.image_of(*back) - *image).norm() < 1e-9 * (1 + image->norm())) << i << " at " << r;
    }
  }
}

TEST(Lens, FisheyesSeeBehindThemselves) {
  const Lens fisheye = lens(LensModel::equidistant, {0.01});
  const Eigen::Vector3d behind(1, 0, -0.5);
  const auto image = fisheye.image_of(behind);
  ASSERT_TRUE(image);
  EXPECT_GT(image->x(), std::numbers::pi / 2);
  EXPECT_LT((*fisheye.ray_of(*image) - behind.normalized()).norm(), 1e-14);
}

TEST(Lens, RefusesWhatIsNoLens) {
  const std::vector<double> six(6, 0.0), nan{std::nan("")};
  EXPECT_NE(Lens::make(LensModel::plumb_bob, six).error().message.find("at most 5"), std::string::npos);
  EXPECT_NE(Lens::make(LensModel::equidistant, nan).error().message.find("finite"), std::string::npos);
  std::vector<double> prism(12, 0.0);
  EXPECT_TRUE(Lens::make(LensModel::rational_polynomial, prism));
  prism[9] = 0.1;
  EXPECT_EQ(Lens::make(LensModel::rational_polynomial, prism).error().kind, Error::Kind::Unsupported);
}

#ifdef NADIR_HAVE_OPENCV_CALIB3D
TEST(Lens, AgreesWithOpenCv) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  const cv::Matx33d k(1, 0, 0, 0, 1, 0, 0, 0, 1);
  int looked_at = 0;
  for (int i = 0; i < 3000; ++i) {
    const LensModel model = models[i % 3];
    const Lens l = random_lens(model, random, 1);
    const Eigen::Vector3d ray(unit(random), unit(random), 1);
    const auto image = l.image_of(ray);
    if (!image) continue;
    const std::vector<cv::Point3d> points = {{ray.x(), ray.y(), ray.z()}};
    std::vector<cv::Point2d> theirs;
    if (model == LensModel::equidistant)
      cv::fisheye::projectPoints(points, theirs, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), k, l.coefficients());
    else
      cv::projectPoints(points, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), k, l.coefficients(), theirs);
    // Towards a pole roundings grow with the square of the distance
    EXPECT_LT(std::hypot(theirs[0].x - image->x(), theirs[0].y - image->y()), 1e-13 * (1 + image->squaredNorm())) << i;
    ++looked_at;
  }
  EXPECT_GT(looked_at, 1500);
}
#endif

}  // namespace
}  // namespace nadir::render

// A case calculated by hand from the formulas of the 2022 ROS/Gazebo plugin that this project follows: antenna at (0,
// 0, 500.5) over a plane of 7643 x 7345 m that carries 6400 x 6150 pixels, level, image top towards +X, f = 110 px, 100
// x 100 px.
#include <gtest/gtest.h>

#include <array>

#include "nadir/render/exact_chain.h"
#include "nadir/render/homography.h"

namespace nadir::render {
namespace {

constexpr double plane_x_m = 7643, plane_y_m = 7345, reference_width = 6400, reference_height = 6150;
constexpr double height_m = 500.5, focal_px = 110, size_px = 100;

/// The plugin's formulas: a corner's ray meets the plane at +-W/2 * height / f; u counts along +X from the left edge, v
/// along -Y from the top one; reference pixels are u * columns, v * rows.
std::array<Eigen::Vector2d, 4> reference_px_by_hand() {
  const double reach_m = size_px / 2 * height_m / focal_px;
  // Corners in this project's order: top left, top right, bottom right, bottom left. Top is +X, right is -Y.
  const std::array<Eigen::Vector2d, 4> world = {
      Eigen::Vector2d(reach_m, reach_m), {reach_m, -reach_m}, {-reach_m, -reach_m}, {-reach_m, reach_m}};
  std::array<Eigen::Vector2d, 4> reference;
  for (std::size_t i = 0; i < 4; ++i) {
    const double u = (world[i].x() + plane_x_m / 2) / plane_x_m, v = (plane_y_m / 2 - world[i].y()) / plane_y_m;
    reference[i] = {u * reference_width, v * reference_height};
  }
  return reference;
}

/// Ours: plane from image by the chain's homography, then the plane's pixels. The plugin's X is our east, its Y our
/// north, so a view with its top towards +X has yaw 90.
Eigen::Matrix3d reference_from_image() {
  const auto origin = geodesy::Geodetic::degrees(35.3090, -80.7417, 0);
  const Plane plane(origin, 0);
  const auto camera = Camera::pinhole(100, 100, focal_px, focal_px, 50, 50).value();
  auto place = origin;
  place.height_m = height_m;
  const ExactChain chain(camera, look_down(place, geodesy::Degrees{90}), plane);
  Eigen::Matrix3d reference_from_plane;
  reference_from_plane << reference_width / plane_x_m, 0, reference_width / 2,  //
      0, -reference_height / plane_y_m, reference_height / 2,                   //
      0, 0, 1;
  return reference_from_plane * chain.plane_from_image();
}

TEST(WorkedCase, CornersAgreeWithTheFormulasToNineDigits) {
  const auto expected = reference_px_by_hand();
  EXPECT_NEAR(expected[0].x(), 3390.501, 5e-4) << "as printed";
  EXPECT_NEAR(expected[0].y(), 2884.513, 5e-4);
  EXPECT_NEAR(expected[1].y(), 3265.487, 5e-4);
  EXPECT_NEAR(expected[3].x(), 3009.499, 5e-4);
  const Eigen::Matrix3d h = reference_from_image();
  const std::array<Eigen::Vector2d, 4> corners = {
      Eigen::Vector2d(0, 0), {size_px, 0}, {size_px, size_px}, {0, size_px}};
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_LT((apply(h, corners[i]) - expected[i]).norm() / expected[i].norm(), 1e-9) << i;
}

TEST(WorkedCase, ItsHomographyIsOursInItsPixelConvention) {
  // The plugin spreads the outer edges of its sensor, 0 to W, over the pixels 0 to W - 1, and counts reference pixels
  // from the outer corner, as our texels do.
  const double spread = (size_px - 1) / size_px;
  Eigen::Matrix3d h =
      Eigen::Vector3d(spread, spread, 1).asDiagonal() * Eigen::Matrix3d(reference_from_image().inverse());
  h /= h(2, 2);
  // The four corner correspondences in double give, with s = spread * f / height:
  const double s = spread * focal_px / height_m, x = s * plane_x_m / reference_width,
               y = s * plane_y_m / reference_height;
  Eigen::Matrix3d expected;
  expected << 0, y, -y * reference_height / 2 + spread * size_px / 2,  //
      -x, 0, x * reference_width / 2 + spread * size_px / 2,           //
      0, 0, 1;
  EXPECT_LT((h - expected).norm() / expected.norm(), 1e-9) << h << "\n" << expected;
  EXPECT_NEAR(expected(0, 1), 0.259861, 5e-7) << "as printed";
  EXPECT_NEAR(expected(0, 2), -749.5714, 5e-5);
  EXPECT_NEAR(expected(1, 0), -0.259841, 5e-7);
  EXPECT_NEAR(expected(1, 2), 880.9912, 5e-5);
}

}  // namespace
}  // namespace nadir::render

// A Web-Mercator metre is not a metre. The 2022 plugin that this project follows made its plane as large as its map's
// metres say: 22.4 % too long to the east and 23.0 % to the north at 35.3 N, and every distance in its pictures with
// it.
#include <gtest/gtest.h>

#include <GeographicLib/Geodesic.hpp>
#include <cmath>

#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

constexpr double radius_m = 6378137;  // of EPSG:3857's sphere
constexpr double texel_m = 1.194328567, height_m = 500.5, focal_px = 530;
constexpr int side = 1024, view_px = 512, mark_texels = 150, mark_half_side = 16;

/// A map at 35.309003 N 80.741692 W: black, with white squares to the east, north, west and south of its middle.
test::SyntheticMap map_with_marks() {
  const double x = radius_m * geodesy::to_radians(-80.741692),
               y = radius_m * std::asinh(std::tan(geodesy::to_radians(35.309003)));
  test::SyntheticMap map;
  map.width = map.height = side;
  map.type = GDT_Byte;
  map.crs = "EPSG:3857";
  map.geotransform = {x - side / 2 * texel_m, texel_m, 0, y + side / 2 * texel_m, 0, -texel_m};
  map.value = [](int, int, int col, int row) {
    const double dx = std::abs(col + 0.5 - side / 2), dy = std::abs(row + 0.5 - side / 2);
    const auto within = [](double along, double across) {
      return std::abs(along - mark_texels) < mark_half_side && across < mark_half_side;
    };
    return within(dx, dy) || within(dy, dx) ? 255 : 0;
  };
  return map;
}

/// Between two texel positions on the ellipsoid.
double geodesic_m(const tile::Map& map, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const auto lat_lon_deg = [&](const Eigen::Vector2d& texel) {
    const Eigen::Vector2d m = map.crs_from_texel() * texel;
    return Eigen::Vector2d(geodesy::to_degrees(std::atan(std::sinh(m.y() / radius_m))),
                           geodesy::to_degrees(m.x() / radius_m));
  };
  const Eigen::Vector2d p = lat_lon_deg(a), q = lat_lon_deg(b);
  double distance_m = 0;
  GeographicLib::Geodesic::WGS84().Inverse(p.x(), p.y(), q.x(), q.y(), distance_m);
  return distance_m;
}

TEST(Scale, DistancesInAWebMercatorMapAreTrueAwayFromTheEquator) {
  const test::TemporaryFolder folder;
  test::write_map(map_with_marks(), folder.file("m.tif"));
  const auto map = tile::Map::open(folder.file("m.tif")).value();
  const Scene scene = Scene::plane(map.center(), {}).with_layer("eo", map);
  const Frame frame =
      Renderer().render(scene, test::square_camera(view_px, focal_px), test::over_centre(map, height_m)).value();

  // Middle of each mark in the picture, in the four sectors around the image's middle: east, south, west, north.
  std::array<Eigen::Vector3d, 4> sums;
  sums.fill(Eigen::Vector3d::Zero());
  const auto pixels = frame.pixels<std::uint8_t>();
  for (int y = 0; y < view_px; ++y)
    for (int x = 0; x < view_px; ++x) {
      const double dx = x + 0.5 - view_px / 2, dy = y + 0.5 - view_px / 2;
      const std::size_t sector = std::abs(dx) > std::abs(dy) ? (dx > 0 ? 0 : 2) : (dy > 0 ? 1 : 3);
      sums[sector] += pixels[static_cast<std::size_t>(y * view_px + x)] * Eigen::Vector3d(dx, dy, 1);
    }
  const auto metres_between = [&](std::size_t a, std::size_t b) {
    return (sums[a].head<2>() / sums[a].z() - sums[b].head<2>() / sums[b].z()).norm() * height_m / focal_px;
  };
  const Eigen::Vector2d middle(side / 2, side / 2), along_x(mark_texels, 0), along_y(0, mark_texels);
  const double east_m = geodesic_m(map, middle - along_x, middle + along_x),
               north_m = geodesic_m(map, middle - along_y, middle + along_y);

  // A grey level off in each of a mark's 4 x 34 edge pixels would move its middle by 0.02 px of 310: 0.01 %.
  EXPECT_NEAR(metres_between(0, 2) / east_m, 1, 1e-4);
  EXPECT_NEAR(metres_between(1, 3) / north_m, 1, 1e-4);
  // The map's metres taken for metres, as the plugin does.
  EXPECT_NEAR(2 * mark_texels * texel_m / east_m, 1.2240, 5e-5);
  EXPECT_NEAR(2 * mark_texels * texel_m / north_m, 1.2295, 5e-5);

  // What is published holds no sampling: lengths on the plane differ from geodesics by (d / R)^2 / 24, 1e-9 at a
  // kilometre.
  const Truth& truth = frame.truth();
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t next = (i + 1) % 4;
    const double published_m = (truth.footprint.corners[i]->enu_m - truth.footprint.corners[next]->enu_m).norm();
    EXPECT_NEAR(published_m / geodesic_m(map, *truth.footprint_texel[i], *truth.footprint_texel[next]), 1, 1e-7) << i;
  }
}

}  // namespace
}  // namespace nadir::render

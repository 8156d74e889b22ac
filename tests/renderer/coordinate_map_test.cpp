// A map whose texels hold their own coordinates renders the projection itself. What it should show is calculated here
// from scratch: GeographicLib's local frame, rotation matrices written out, projections by formula or by GeographicLib.
#include <gtest/gtest.h>

#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <cmath>
#include <functional>
#include <numbers>

#include "nadir/render/renderer.h"
#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr int width = 320, height = 240;
constexpr double focal_px = 300;

struct Case {
  const char* name;
  const char* crs;
  double lat_deg, lon_deg;
  std::array<double, 6> geotransform;  // of a map of 1000 x 1000 texels with the place in its middle
  std::function<Eigen::Vector2d(double lat_deg, double lon_deg)> project;
  bool pixel_is_point = false;  // says the file; the geotransform stays that of corners
};

Eigen::Vector2d utm(int zone, double lat_deg, double lon_deg) {
  bool north = true;
  int found = 0;
  Eigen::Vector2d p;
  GeographicLib::UTMUPS::Forward(lat_deg, lon_deg, found, north, p.x(), p.y(), zone);
  return p;
}

/// The geotransform of a grid with `dx`, `dy` a texel, turned by an angle, whose texel (500, 500) is at `middle`.
std::array<double, 6> around(const Eigen::Vector2d& middle, double dx, double dy, double angle = 0) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double a = dx * c, b = dy * s, d = dx * s, e = -dy * c;
  return {middle.x() - 500 * (a + b), a, b, middle.y() - 500 * (d + e), d, e};
}

/// Rows that lean on each other, and columns along neither axis.
std::array<double, 6> sheared(const Eigen::Vector2d& middle) {
  const double a = 8, b = 4, d = 3, e = -9;
  return {middle.x() - 500 * (a + b), a, b, middle.y() - 500 * (d + e), d, e};
}

/// Snyder, Map Projections - A Working Manual, 1987, chapter 21: a pole in the middle, true to scale at a latitude.
Eigen::Vector2d polar(double side, double true_lat_deg, double meridian_deg, double lat_deg, double lon_deg) {
  const double f = 1 / 298.257223563, e = std::sqrt(f * (2 - f));
  const auto t = [&](double lat) {
    return std::tan(std::numbers::pi / 4 - lat / 2) *
           std::pow((1 + e * std::sin(lat)) / (1 - e * std::sin(lat)), e / 2);
  };
  const double c = true_lat_deg * degree, es = e * std::sin(c), l = (lon_deg - meridian_deg) * degree;
  const double rho = 6378137 * std::cos(c) / std::sqrt(1 - es * es) / t(c) * t(side * lat_deg * degree);
  return {rho * std::sin(l), -side * rho * std::cos(l)};
}

std::vector<Case> cases() {
  const auto mercator = [](double lat, double lon) {
    return Eigen::Vector2d(6378137 * lon * degree, 6378137 * std::asinh(std::tan(lat * degree)));
  };
  const auto lon_lat = [](double lat, double lon) { return Eigen::Vector2d(lon, lat); };
  const auto utm36 = [](double lat, double lon) { return utm(36, lat, lon); };
  const auto utm14 = [](double lat, double lon) { return utm(14, lat, lon); };
  const auto arctic = [](double lat, double lon) { return polar(1, 70, -45, lat, lon); };
  const auto antarctic = [](double lat, double lon) { return polar(-1, 71, 0, lat, lon); };
  return {{"geographic", "EPSG:4326", 38.1, -0.76, around({-0.76, 38.1}, 9e-5, 9e-5), lon_lat},
          {"mercator", "EPSG:3857", 60.3, 25.1, around(mercator(60.3, 25.1), 19, 19), mercator},
          {"utm", "EPSG:32636", 0.3516, 32.5896, around(utm36(0.3516, 32.5896), 9, 9), utm36},
          {"rotated", "EPSG:32614", 47, -99.2, around(utm14(47, -99.2), 9, 7, 0.6), utm14},
          {"north_pole", "EPSG:3413", 89.995, 100, around(arctic(89.995, 100), 9, 9), arctic},
          {"antarctic", "EPSG:3031", -78, 180, around(antarctic(-78, 180), 9, 9), antarctic},
          {"sheared", "EPSG:32614", 47, -99.2, sheared(utm14(47, -99.2)), utm14},
          {"points", "EPSG:32614", 47, -99.2, around(utm14(47, -99.2), 9, 9), utm14, true},
          {"mirrored", "EPSG:32614", 47, -99.2, around(utm14(47, -99.2), -9, 9), utm14}};
}

/// yaw, pitch, roll in degrees: level, level and turned, and 60 degrees off nadir to several sides.
const std::vector<std::array<double, 3>> attitudes = {
    {0, 0, 0}, {130, 0, 0}, {20, 60, 0}, {290, 0, 60}, {200, -45, 40}};

/// Where a pixel looks, on the map: from scratch.
Eigen::Vector2d texel_by_hand(const Case& c, const std::array<double, 3>& attitude, double height_m, double px,
                              double py) {
  const double cy = std::cos(attitude[0] * degree), sy = std::sin(attitude[0] * degree),
               cp = std::cos(attitude[1] * degree), sp = std::sin(attitude[1] * degree),
               cr = std::cos(attitude[2] * degree), sr = std::sin(attitude[2] * degree);
  // Pixel centre to camera ray to body: right is right, image down is back, the axis is down.
  const double right = (px - width / 2.0) / focal_px, back = (py - height / 2.0) / focal_px;
  const double f = -back, r = right, d = 1;
  // Body to north-east-down: yaw, pitch, roll written out
  const double north = cp * cy * f + (sr * sp * cy - cr * sy) * r + (cr * sp * cy + sr * sy) * d;
  const double east = cp * sy * f + (sr * sp * sy + cr * cy) * r + (cr * sp * sy - sr * cy) * d;
  const double down = -sp * f + sr * cp * r + cr * cp * d;
  const GeographicLib::LocalCartesian local(c.lat_deg, c.lon_deg, 0);
  double lat = 0, lon = 0, h = 0;
  local.Reverse(east / down * height_m, north / down * height_m, 0, lat, lon, h);
  const Eigen::Vector2d crs = c.project(lat, lon);
  const auto& g = c.geotransform;
  Eigen::Matrix2d m;
  m << g[1], g[2], g[4], g[5];
  return m.inverse() * (crs - Eigen::Vector2d(g[0], g[3]));
}

class CoordinateMap : public testing::TestWithParam<Case> {};

TEST_P(CoordinateMap, RendersTheProjectionWithinTheBound) {
  const Case& c = GetParam();
  const test::TemporaryFolder folder;
  test::SyntheticMap synthetic;
  synthetic.width = synthetic.height = 1000;
  synthetic.bands = 2;
  synthetic.pixel_is_point = c.pixel_is_point;
  synthetic.crs = c.crs;
  synthetic.geotransform = c.geotransform;
  synthetic.value = [](int, int band, int col, int row) {
    return (band == 0 ? col : row) + 0.5;
  };  // of the texel's centre
  test::write_map(synthetic, folder.file("m.tif"));
  const auto map = tile::Map::open(folder.file("m.tif")).value();
  const auto origin = geodesy::Geodetic::degrees(c.lat_deg, c.lon_deg, 0);
  const Scene scene = Scene::plane(origin, {.height_m = 0}).with_layer("xy", map);
  const Camera camera = Camera::pinhole(width, height, focal_px, focal_px, width / 2.0, height / 2.0).value();
  Renderer renderer;

  for (const double height_m : {250.0, 2600.0})
    for (const auto& attitude : attitudes) {
      const Filter filter = height_m == 250.0 && attitude[0] == 20 ? Filter::Bicubic : Filter::Bilinear;
      const auto place = geodesy::Geodetic::degrees(c.lat_deg, c.lon_deg, height_m);
      const auto pose = camera_pose(place, geodesy::YawPitchRoll::degrees(attitude[0], attitude[1], attitude[2]));
      // One sample a pixel of a linear function is exact: what differs is geometry.
      const Frame frame =
          renderer.render(scene, camera, pose, {.filter = filter, .geometry_tolerance_px = 0.05}).value();
      const auto pixels = frame.pixels<float>();
      double worst_px = 0;
      std::int64_t compared = 0;
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const std::size_t i = static_cast<std::size_t>(y * width + x);
          if (!frame.layer().validity[i]) continue;
          const Eigen::Vector2d expected = texel_by_hand(c, attitude, height_m, x + 0.5, y + 0.5);
          if ((expected.array() < 2).any() || (expected.array() > 998).any())
            continue;  // samples flatten towards the map's edge
          Eigen::Matrix2d j;
          j.col(0) =
              texel_by_hand(c, attitude, height_m, x + 1, y + 0.5) - texel_by_hand(c, attitude, height_m, x, y + 0.5);
          j.col(1) =
              texel_by_hand(c, attitude, height_m, x + 0.5, y + 1) - texel_by_hand(c, attitude, height_m, x + 0.5, y);
          worst_px =
              std::max(worst_px, (j.inverse() * (Eigen::Vector2d(pixels[2 * i], pixels[2 * i + 1]) - expected)).norm());
          ++compared;
        }
      // Floats of 512 to 1000 are 6e-5 apart; a pixel spans at least 0.09 texels here, so they add under 1e-3 px.
      EXPECT_LE(worst_px, 0.05 + 1e-3) << "yaw, pitch, roll " << attitude[0] << " " << attitude[1] << " " << attitude[2]
                                       << " at " << height_m;
      EXPECT_GT(compared, width * height / 10) << "too little of the map is in view to tell";
    }
}

TEST_P(CoordinateMap, TruthAgreesWithTheProjection) {
  const Case& c = GetParam();
  const test::TemporaryFolder folder;
  test::SyntheticMap synthetic;
  synthetic.width = synthetic.height = 1000;
  synthetic.crs = c.crs;
  synthetic.geotransform = c.geotransform;
  synthetic.value = [](int, int, int, int) { return 1; };
  test::write_map(synthetic, folder.file("m.tif"));
  const auto map = tile::Map::open(folder.file("m.tif")).value();
  const Scene scene = Scene::plane(geodesy::Geodetic::degrees(c.lat_deg, c.lon_deg, 0), {}).with_layer("xy", map);
  const Camera camera = Camera::pinhole(width, height, focal_px, focal_px, width / 2.0, height / 2.0).value();
  const std::array<double, 3> attitude = {30, 20, -10};
  const auto pose =
      camera_pose(geodesy::Geodetic::degrees(c.lat_deg, c.lon_deg, 800), geodesy::YawPitchRoll::degrees(30, 20, -10));
  const Frame frame = Renderer().render(scene, camera, pose).value();
  const Truth& truth = frame.truth();

  const std::array<Eigen::Vector2d, 4> corners = {Eigen::Vector2d(0, 0), {width, 0}, {width, height}, {0, height}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d expected = texel_by_hand(c, attitude, 800, corners[i].x(), corners[i].y());
    ASSERT_TRUE(truth.footprint_texel[i]);
    EXPECT_NEAR((*truth.footprint_texel[i] - expected).norm(), 0, 1e-6);
    EXPECT_NEAR((*truth.footprint_uv[i] - expected / 1000).norm(), 0, 1e-9);
    // Homographies count from pixel centres on both sides.
    const Eigen::Vector2d half(0.5, 0.5);
    EXPECT_NEAR((apply(*truth.map_pixel_from_image_pixel, corners[i] - half) - (expected - half)).norm(), 0, 1e-6);
    EXPECT_NEAR((apply(*truth.image_pixel_from_map_pixel, expected - half) - (corners[i] - half)).norm(), 0, 1e-6);
  }
  EXPECT_LE(*truth.homography_max_error_px, 0.05);
  EXPECT_NEAR(geodesy::to_degrees(truth.attitude.yaw_rad), 30, 1e-9);
  EXPECT_NEAR(geodesy::to_degrees(truth.attitude.pitch_rad), 20, 1e-9);
  EXPECT_NEAR(geodesy::to_degrees(truth.attitude.roll_rad), -10, 1e-9);
  EXPECT_NEAR(truth.height_agl_m, 800, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Crs, CoordinateMap, testing::ValuesIn(cases()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace nadir::render

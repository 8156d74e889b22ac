// What a camera in motion shows: blur, and rows of different moments.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <thread>

#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

using test::TemporaryFolder;

constexpr int side_px = 128;
constexpr double focal_px = 100, height_m = 200;  // a pixel is 2 m

/// Level flight over a map's middle, there at time 0.
CameraMotion flying_east(const tile::Map& map, double speed_mps) {
  const CameraPose middle = test::over_centre(map, height_m);
  const Eigen::Vector3d east = geodesy::ecef_from_ned(map.center()).rotation * Eigen::Vector3d::UnitY();
  std::vector<Moment> moments;
  for (const double t : {-1.0, 1.0}) moments.push_back({t, {middle.rotation, middle.origin + t * speed_mps * east}});
  return CameraMotion::through(std::move(moments)).value();
}

class ExposureTest : public testing::Test {
 protected:
  tile::Map make(const std::string& name, const std::function<double(int, int, int, int)>& value,
                 GDALDataType type = GDT_Float32) {
    test::SyntheticMap synthetic = test::utm_map(512, 1);
    synthetic.type = type;
    synthetic.factors = {2, 4};
    synthetic.value = value;
    test::write_map(synthetic, folder.file(name));
    return tile::Map::open(folder.file(name)).value();
  }
  static Frame render(const tile::Map& map, const CameraMotion& motion, const Shutter& shutter, LayerOptions layer = {},
                      RenderOptions options = {}, int threads = 0) {
    return Renderer({.threads = threads})
        .render(Scene::plane(map.center(), {}).with_layer("eo", map, std::move(layer)),
                test::square_camera(side_px, focal_px), motion, shutter, options)
        .value();
  }
  static float at(const Frame& frame, int x, int y) {
    return frame.pixels<float>()[static_cast<std::size_t>(y * side_px + x)];
  }
  TemporaryFolder folder;
};

TEST_F(ExposureTest, AnEdgeBecomesARampAsLongAsTheMotion) {
  // 0 in the west, 100 in the east; flying east, what is seen goes left by 20 px in the exposure
  const auto map = make("edge.tif", [](int level, int, int col, int) { return (col << level) < 256 ? 0 : 100; });
  const Frame frame = render(map, flying_east(map, 400), {.exposure_s = 0.1});
  ASSERT_TRUE(frame.truth().exposure);
  EXPECT_NEAR(frame.truth().exposure->motion_px, 20, 1e-3);
  EXPECT_EQ(frame.truth().exposure->poses, std::ceil(frame.truth().exposure->motion_px / 2));
  // With the edge at x = 64 in the middle of the exposure, it was there from 74 down to 54: a pixel sees 100 for the
  // part of the time in which the edge is to its left.
  for (int x = 40; x < 90; ++x)
    EXPECT_NEAR(at(frame, x, 64), 100 * std::clamp((x + 0.5 - 54) / 20, 0.0, 1.0), 100 * 1.2 / 20) << x;
  const Frame fine = render(map, flying_east(map, 400), {.exposure_s = 0.1}, {}, {.motion_step_px = 0.25});
  EXPECT_EQ(fine.truth().exposure->poses, std::ceil(fine.truth().exposure->motion_px / 0.25));
  for (int x = 57; x < 71; ++x) EXPECT_NEAR(at(fine, x, 64), 100 * (x + 0.5 - 54) / 20, 0.7) << x;
}

TEST_F(ExposureTest, RowsOfARollingShutterAreOfTheirMoments) {
  const auto map = make("columns.tif", [](int level, int, int col, int) { return (col + 0.5) * (1 << level); });
  const double speed_mps = 300, readout_s = 0.08;
  const Frame frame = render(map, flying_east(map, speed_mps), {.readout_s = readout_s});
  const Frame still = render(map, flying_east(map, speed_mps), {});
  EXPECT_FALSE(still.truth().exposure);
  EXPECT_EQ(frame.truth().exposure->poses, 1);
  for (const int y : {0, 17, 64, 100, 127})
    for (const int x : {5, 64, 120}) {
      const double moved_m = speed_mps * readout_s * ((y + 0.5) / side_px - 0.5);  // a texel is a metre
      EXPECT_NEAR(at(frame, x, y) - at(still, x, y), moved_m, 0.15) << x << ", " << y;
    }
  // Blurred too, a ramp keeps its values
  const Frame both = render(map, flying_east(map, speed_mps), {.exposure_s = 0.02, .readout_s = readout_s});
  EXPECT_EQ(both.truth().exposure->poses, 2);
  for (const int y : {3, 90}) EXPECT_NEAR(at(both, 70, y), at(frame, 70, y), 0.15);
}

TEST_F(ExposureTest, StillCamerasAndInstantShuttersMakeTheStillFrame) {
  const auto map = make("m.tif", [](int level, int, int col, int row) { return (col * 31 + row * 17 + level) % 97; });
  const Scene scene = Scene::plane(map.center(), {}).with_layer("eo", map);
  const Frame still =
      Renderer().render(scene, test::square_camera(side_px, focal_px), test::over_centre(map, height_m)).value();
  const Frame instant = render(map, flying_east(map, 50), {});
  EXPECT_EQ(instant.layer().samples, still.layer().samples);
  const Frame standing = render(map, flying_east(map, 0), {.exposure_s = 0.5});
  EXPECT_EQ(standing.truth().exposure->poses, 1);
  EXPECT_EQ(standing.layer().samples, still.layer().samples);
  EXPECT_EQ(standing.counters().exact_points, still.counters().exact_points);
}

TEST_F(ExposureTest, DecibelsAreAveragedInPowerAndLabelsNotAtAll) {
  const auto db = make("db.tif", [](int level, int, int col, int) { return (col << level) < 256 ? -20 : 0; });
  const Frame frame =
      render(db, flying_east(db, 400), {.exposure_s = 0.1}, {.role = tile::Role::Radar}, {.motion_step_px = 0.5});
  EXPECT_NEAR(at(frame, 64, 64), 10 * std::log10((10.5 * 1 + 9.5 * 0.01) / 20), 0.15);

  const auto labels = make(
      "labels.tif", [](int, int, int col, int row) { return (col / 5 + row / 3) % 2 ? 200 : 10; }, GDT_Byte);
  const Frame classes = render(labels, flying_east(labels, 400), {.exposure_s = 0.1}, {.role = tile::Role::Labels});
  const Frame middle = render(labels, flying_east(labels, 400), {}, {.role = tile::Role::Labels});
  EXPECT_EQ(classes.layer().samples, middle.layer().samples);
}

TEST_F(ExposureTest, APixelIsValidThatSeesTheMapForHalfOfTheTime) {
  const auto map = make("m.tif", [](int, int, int, int) { return 50; });
  // The map ends 256 m east of the middle; the image reaches 128 m: look from 192 m east
  CameraPose pose = test::over_centre(map, height_m);
  const Eigen::Vector3d east = geodesy::ecef_from_ned(map.center()).rotation * Eigen::Vector3d::UnitY();
  std::vector<Moment> moments;
  for (const double t : {-1.0, 1.0}) moments.push_back({t, {pose.rotation, pose.origin + (192 + t * 400) * east}});
  const Frame frame =
      render(map, CameraMotion::through(moments).value(), {.exposure_s = 0.1}, {}, {.motion_step_px = 0.5});
  const auto valid = [&](int x) { return frame.layer().validity[static_cast<std::size_t>(64 * side_px + x)]; };
  EXPECT_EQ(valid(94), 1);
  EXPECT_EQ(valid(97), 0);
  EXPECT_EQ(at(frame, 94, 64), 50) << "what is off the map takes no part";
  EXPECT_TRUE(std::isnan(at(frame, 97, 64)));
}

TEST_F(ExposureTest, TheSameBytesForAnyThreadCount) {
  const auto map = make(
      "m.tif", [](int level, int, int col, int row) { return (col * 7919 + row * 104729 + level) % 251; }, GDT_Byte);
  const Shutter shutter = {.exposure_s = 0.05, .readout_s = 0.03};
  const Frame one = render(map, flying_east(map, 300), shutter, {}, {}, 1);
  for (const int threads : {2, 5})
    EXPECT_EQ(render(map, flying_east(map, 300), shutter, {}, {}, threads).layer().samples, one.layer().samples);
}

TEST_F(ExposureTest, TooLongAnExposureIsRefusedWithItsMotion) {
  const auto map = make("m.tif", [](int, int, int, int) { return 50; });
  const Scene scene = Scene::plane(map.center(), {}).with_layer("eo", map);
  const auto frame = Renderer().render(scene, test::square_camera(side_px, focal_px), flying_east(map, 400),
                                       Shutter{.exposure_s = 100});
  ASSERT_FALSE(frame);
  EXPECT_NE(frame.error().message.find("20000 px"), std::string::npos) << frame.error().message;
  EXPECT_FALSE(Renderer().render(scene, test::square_camera(side_px, focal_px), flying_east(map, 400),
                                 Shutter{.exposure_s = -1}));
  EXPECT_FALSE(Renderer().render(scene, test::square_camera(side_px, focal_px), flying_east(map, 400),
                                 Shutter{.exposure_s = 0.1}, {.motion_step_px = 0}));
}

}  // namespace
}  // namespace nadir::render

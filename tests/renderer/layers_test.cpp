#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

using test::TemporaryFolder;

tile::Map make(const TemporaryFolder& folder, const std::string& name, const test::SyntheticMap& synthetic) {
  test::write_map(synthetic, folder.file(name));
  return tile::Map::open(folder.file(name)).value();
}

TEST(Layers, NorthIsUpAndEastIsRightInALevelView) {
  const TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(200, 1);
  synthetic.value = [](int, int, int col, int row) {
    return col > 120 && row < 60 ? 9 : 1;
  };  // a block in the north-east
  const auto map = make(folder, "m.tif", synthetic);
  const Frame frame = Renderer()
                          .render(Scene::plane(map.center(), {}).with_layer("eo", map), test::square_camera(100, 100),
                                  test::over_centre(map, 200))
                          .value();
  const auto at = [&](int x, int y) { return frame.pixels<float>()[static_cast<std::size_t>(y * 100 + x)]; };
  EXPECT_EQ(at(85, 10), 9) << "top right";
  EXPECT_EQ(at(10, 10), 1);
  EXPECT_EQ(at(85, 90), 1);
  EXPECT_EQ(at(10, 90), 1);
}

TEST(Layers, DecibelsAreAveragedInPower) {
  const TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(256, 1);
  synthetic.value = [](int, int, int col, int) { return col % 2 ? 0 : -20; };  // powers 1 and 0.01
  const auto map = make(folder, "m.tif", synthetic);
  const Scene scene = Scene::plane(map.center(), {}).with_layer("sar", map, {.role = tile::Role::Radar});
  // Level 0 alone, two texels a pixel: the mean power is 0.505, -2.967 dB; the mean of the decibels would be -10.
  const Frame frame =
      Renderer()
          .render(scene, test::square_camera(64, 100), test::over_centre(map, 200), {.filter = Filter::Reference})
          .value();
  EXPECT_NEAR(frame.pixels<float>()[32 * 64 + 32], 10 * std::log10(0.505), 0.2);
}

TEST(Layers, LabelsAreNeverBlended) {
  const TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(256, 1);
  synthetic.type = GDT_Byte;
  synthetic.value = [](int, int, int col, int row) { return (col / 5 + row / 3) % 2 ? 200 : 10; };
  const auto map = make(folder, "m.tif", synthetic);
  const Scene scene = Scene::plane(map.center(), {}).with_layer("class", map, {.role = tile::Role::Labels});
  const Frame frame =
      Renderer()
          .render(scene, test::square_camera(128, 130), test::over_centre(map, 77), {.quality = Quality::best})
          .value();
  EXPECT_EQ(frame.truth().filter, Filter::Nearest);
  for (const std::uint8_t value : frame.pixels<std::uint8_t>()) ASSERT_TRUE(value == 200 || value == 10) << int(value);
}

TEST(Layers, LayersOfOneGridShareTheirMapping) {
  const TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(256, 1);
  synthetic.value = [](int, int, int col, int row) { return col + 0.001 * row; };
  const auto one = make(folder, "1.tif", synthetic), two = make(folder, "2.tif", synthetic);
  const Scene first = Scene::plane(one.center(), {}).with_layer("a", one), both = first.with_layer("b", two);
  Renderer renderer;
  const Camera camera = test::square_camera(64, 100);
  const Frame alone = renderer.render(first, camera, test::over_centre(one, 100)).value();
  const Frame together = renderer.render(both, camera, test::over_centre(one, 100)).value();
  EXPECT_EQ(together.counters().exact_points, alone.counters().exact_points)
      << "the second layer costs its sampling only";
  EXPECT_EQ(together.layer("a").samples, together.layer("b").samples);
}

TEST(Layers, LayersOfOneGridAreSampledTogetherAndShowWhatTheyShowAlone) {
  const TemporaryFolder folder;
  test::SyntheticMap synthetic = test::busy_map();
  const auto a = make(folder, "a.tif", synthetic);
  synthetic.value = [](int level, int band, int col, int row) { return (col * 31 + row * 17 + band + level) % 253; };
  synthetic.mask_value = [](int col, int row) { return (col + row) / 90 % 4 == 0 ? 0 : 255; };
  const auto b = make(folder, "b.tif", synthetic);
  synthetic.mask = false;
  const auto whole = make(folder, "whole.tif", synthetic);
  synthetic.geotransform[0] += 0.25;
  const auto beside = make(folder, "beside.tif", synthetic);
  const auto scene_of = [&](const std::vector<std::pair<std::string, tile::Map>>& layers) {
    Scene scene = Scene::plane(a.center(), {});
    for (const auto& [name, map] : layers) scene = scene.with_layer(name, map);
    return scene;
  };
  const std::vector<std::pair<std::string, tile::Map>> layers = {
      {"a", a}, {"beside", beside}, {"b", b}, {"whole", whole}};
  const Scene together =
      scene_of(layers).with_layer("one band", b, {.bands = {2}}).with_layer("classes", b, {.role = tile::Role::Labels});
  geodesy::Geodetic place = a.center();
  place.height_m = 500;
  const Camera camera = Camera::pinhole(330, 210, 260, 260, 165, 105).value();
  for (const double pitch_deg : {0.0, 55.0, 80.0}) {
    const CameraPose pose = camera_pose(place, geodesy::YawPitchRoll::degrees(33, pitch_deg, 8));
    for (const Quality quality : {Quality::draft, Quality::balanced, Quality::best})
      for (const std::uint64_t cache_bytes : {256u << 20, 2u << 20}) {  // in one pass, in some
        Renderer renderer({.cache_bytes = cache_bytes});
        const Frame frame = renderer.render(together, camera, pose, {.quality = quality}).value();
        EXPECT_EQ(frame.counters().passes == 1, cache_bytes > (2u << 20));
        EXPECT_GT(frame.counters().blocks_shared, 5) << "this shows nothing";
        for (const auto& layer : layers) {
          const Frame alone = Renderer().render(scene_of({layer}), camera, pose, {.quality = quality}).value();
          EXPECT_EQ(alone.counters().blocks_shared, 0);
          EXPECT_TRUE(frame.layer(layer.first).samples == alone.layer().samples) << layer.first << ", " << pitch_deg;
          EXPECT_TRUE(frame.layer(layer.first).validity == alone.layer().validity) << layer.first << ", " << pitch_deg;
        }
        const Scene classes = Scene::plane(a.center(), {}).with_layer("classes", b, {.role = tile::Role::Labels});
        EXPECT_TRUE(frame.layer("classes").samples ==
                    Renderer().render(classes, camera, pose, {.quality = quality}).value().layer().samples);
      }
  }
}

TEST(Layers, AnInvalidTexelTakesNoPartAndDoesNotSpread) {
  const TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(256, 1);
  synthetic.value = [](int, int, int col, int) { return col == 128 ? std::numeric_limits<double>::quiet_NaN() : 50.0; };
  const auto map = make(folder, "m.tif", synthetic);
  const Frame frame = Renderer()
                          .render(Scene::plane(map.center(), {}).with_layer("eo", map), test::square_camera(128, 400),
                                  test::over_centre(map, 100))
                          .value();
  std::int64_t invalid = 0;
  for (std::size_t i = 0; i < frame.layer().validity.size(); ++i) {
    if (!frame.layer().validity[i]) {
      ++invalid;
      continue;
    }
    ASSERT_NEAR(frame.pixels<float>()[i], 50, 1e-4) << "a mean over valid texels only";
  }
  EXPECT_NEAR(static_cast<double>(invalid) / 128, 4, 1) << "a texel of four pixels, and nothing around it";
}

TEST(Layers, OutputIsScaledToTheRangeAsked) {
  const TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(256, 1);
  synthetic.type = GDT_Int16;
  synthetic.value = [](int, int, int col, int) { return col < 128 ? 1500 : 9000; };
  const auto map = make(folder, "m.tif", synthetic);
  const Scene scene =
      Scene::plane(map.center(), {}).with_layer("eo", map, {.output = Output{tile::SampleType::UInt8, 0, 3000}});
  const Frame frame = Renderer().render(scene, test::square_camera(64, 100), test::over_centre(map, 100)).value();
  EXPECT_EQ(frame.pixels<std::uint8_t>()[32 * 64 + 5], 128) << "1500 of 3000, rounded up from 127.5";
  EXPECT_EQ(frame.pixels<std::uint8_t>()[32 * 64 + 60], 255) << "clamped";
}

TEST(Layers, FaultsInALayerAreReportedWhenTheSceneIsRendered) {
  const TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(64, 1);
  synthetic.value = [](int, int, int, int) { return 1; };
  const auto map = make(folder, "m.tif", synthetic);
  const Scene scene = Scene::plane(map.center(), {});
  EXPECT_FALSE(scene.check()) << "no layer";
  EXPECT_EQ(scene.with_layer("a", map, {.bands = {7}}).check().error().kind, Error::Kind::NotFound);
  EXPECT_FALSE(scene.with_layer("a", map).with_layer("a", map).check()) << "a name twice";
  EXPECT_FALSE(scene.with_layer("a", map, {.output = Output{tile::SampleType::UInt8, 5, 5}}).check())
      << "an empty range";
  Renderer renderer;
  EXPECT_FALSE(renderer.render(scene, test::square_camera(8, 8), test::over_centre(map, 10)));
  const Scene good = scene.with_layer("a", map);
  EXPECT_FALSE(renderer.render(good, test::square_camera(8, 8), {Eigen::Quaterniond(0, 0, 0, 0), {1, 2, 3}}))
      << "no rotation";
  EXPECT_FALSE(
      renderer.render(good, test::square_camera(8, 8), {Eigen::Quaterniond(1, 0, 0, 0), {std::nan(""), 2, 3}}));
  EXPECT_FALSE(
      renderer.render(good, test::square_camera(8, 8), test::over_centre(map, 10), {.geometry_tolerance_px = 0}));
}

}  // namespace
}  // namespace nadir::render

// What a scene does not need is not done: by counters, not by words.
#include <gtest/gtest.h>

#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

TEST(Work, ASmallViewReadsItsCellsAndBandsOnly) {
  const test::TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(2048, 1);
  synthetic.type = GDT_Byte;
  synthetic.bands = 5;
  synthetic.value = [](int, int band, int, int) { return band; };
  test::write_map(synthetic, folder.file("m.tif"));
  const auto map = tile::Map::open(folder.file("m.tif")).value();
  const Scene scene = Scene::plane(map.center(), {}).with_layer("eo", map, {.bands = {5, 1}});
  Renderer renderer;
  const Camera camera = test::square_camera(100, 100);
  const Frame cold = renderer.render(scene, camera, test::over_centre(map, 100)).value();
  EXPECT_EQ(cold.counters().cells, 4) << "100 texels a side around a corner of four cells";
  EXPECT_EQ(cold.counters().windows_read, 4);
  EXPECT_EQ(cold.counters().samples_read, 4 * tile::cell_size * tile::cell_size * 2) << "two bands of five";
  EXPECT_EQ(cold.counters().exact_points, 13) << "one homography, checked at nine points";

  const Frame warm = renderer.render(scene, camera, test::over_centre(map, 100)).value();
  EXPECT_EQ(warm.counters().windows_read, 0);
  EXPECT_EQ(warm.counters().cells_loaded, 0);
  EXPECT_EQ(warm.layer().samples, cold.layer().samples);
}

TEST(Work, AMapInLongitudeAndLatitudeNeverCallsTheProjectionLibrary) {
  const test::TemporaryFolder folder;
  test::SyntheticMap synthetic;
  synthetic.width = synthetic.height = 512;
  synthetic.geotransform = {-0.78, 9e-5, 0, 38.13, 0, -9e-5};
  synthetic.value = [](int, int, int, int) { return 1; };
  test::write_map(synthetic, folder.file("m.tif"));
  const auto map = tile::Map::open(folder.file("m.tif")).value();
  const Frame frame = Renderer()
                          .render(Scene::plane(map.center(), {}).with_layer("eo", map), test::square_camera(300, 300),
                                  test::over_centre(map, 2000))
                          .value();
  EXPECT_EQ(frame.counters().projection_points, 0);
  EXPECT_GT(frame.truth().valid_fraction, 0.99);
}

TEST(Work, CostDoesNotGrowWithTheMap) {
  const test::TemporaryFolder folder;
  FrameCounters counters[2];
  for (int i = 0; i < 2; ++i) {
    test::SyntheticMap synthetic = test::utm_map(i == 0 ? 512 : 4096, 1);
    synthetic.type = GDT_Byte;
    synthetic.value = [](int, int, int, int) { return 1; };
    test::write_map(synthetic, folder.file("m.tif"));
    const auto map = tile::Map::open(folder.file("m.tif")).value();
    counters[i] = Renderer()
                      .render(Scene::plane(map.center(), {}).with_layer("eo", map), test::square_camera(200, 200),
                              test::over_centre(map, 200))
                      .value()
                      .counters();
  }
  EXPECT_EQ(counters[0].cells, counters[1].cells);
  EXPECT_EQ(counters[0].samples_read, counters[1].samples_read);
  EXPECT_EQ(counters[0].exact_points, counters[1].exact_points);
}

}  // namespace
}  // namespace nadir::render

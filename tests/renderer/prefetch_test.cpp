#include <gtest/gtest.h>

#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

class Prefetch : public testing::Test {
 protected:
  Prefetch() {
    test::SyntheticMap synthetic = test::utm_map(2048, 1);
    synthetic.type = GDT_Byte;
    synthetic.factors = {2, 4, 8};
    synthetic.value = [](int level, int, int col, int row) { return (col * 7919 + row * 104729 + level * 17) % 251; };
    test::write_map(synthetic, folder.file("m.tif"));
    map.emplace(tile::Map::open(folder.file("m.tif")).value());
    scene.emplace(Scene::plane(map->center(), {}).with_layer("eo", *map));
  }
  CameraPose pose(double height_m, double yaw_deg) const {
    geodesy::Geodetic place = map->center();
    place.height_m = height_m;
    return camera_pose(place, geodesy::YawPitchRoll::degrees(yaw_deg, 20, 3));
  }
  test::TemporaryFolder folder;
  std::optional<tile::Map> map;
  std::optional<Scene> scene;
  const Camera camera = test::square_camera(200, 200);
};

TEST_F(Prefetch, WhatAFrameNeedsIsThereWhenItComesAndNothingElse) {
  for (const double height_m : {150.0, 900.0}) {
    Renderer cold, warm;
    const Frame reference = cold.render(*scene, camera, pose(height_m, 30)).value();
    ASSERT_GT(reference.counters().cells_loaded, 0);
    const auto ticket = warm.prefetch(*scene, camera, pose(height_m, 30));
    warm.wait_for_prefetch();
    EXPECT_EQ(warm.cache_counters().loads, cold.cache_counters().loads);
    const Frame frame = warm.render(*scene, camera, pose(height_m, 30)).value();
    EXPECT_EQ(frame.counters().cells_loaded, 0);
    EXPECT_EQ(frame.layer().samples, reference.layer().samples);
  }
}

TEST_F(Prefetch, FramesAreTheSameWhateverIsBeingLoaded) {
  Renderer plain, busy({.cache_bytes = 3 << 20});
  tile::CellCache::Ticket coming;
  for (int i = 0; i < 12; ++i) {
    coming = busy.prefetch(*scene, camera, pose(150 + 80 * i, 25 * i));  // some of it right, some not
    EXPECT_EQ(busy.render(*scene, camera, pose(150 + 70 * i, 20 * i)).value().layer().samples,
              plain.render(*scene, camera, pose(150 + 70 * i, 20 * i)).value().layer().samples);
  }
  EXPECT_LE(busy.cache_counters().peak_bytes, 3u << 20);
}

TEST_F(Prefetch, WhatCannotBeRenderedIsLeftForRenderToSay) {
  Renderer renderer;
  auto ticket = renderer.prefetch(*scene, camera, {Eigen::Quaterniond(0, 0, 0, 0), {1, 2, 3}});
  ticket = renderer.prefetch(*scene, camera, pose(150, 0), {.geometry_tolerance_px = -1});
  ticket = renderer.prefetch(scene->with_layer("eo", *map), camera, pose(150, 0));
  renderer.wait_for_prefetch();
  EXPECT_EQ(renderer.cache_counters().loads, 0);
}

}  // namespace
}  // namespace nadir::render

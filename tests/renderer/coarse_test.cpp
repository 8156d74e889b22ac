// Frames that do not wait for the disk: what they show, what they say of it, and that the next one is whole.
#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "nadir/pyramid/build.h"
#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

constexpr RenderOptions coarse{.allow_coarse = true};

/// A map whose level k holds 10 (k + 1): a frame of it shows the level that each pixel came from.
test::SyntheticMap level_map(std::vector<int> factors) {
  test::SyntheticMap map = test::utm_map(2048, 1);
  map.type = GDT_Byte;
  map.factors = std::move(factors);
  map.value = [](int level, int, int, int) { return 10 * (level + 1); };
  return map;
}

class Coarse : public testing::Test {
 protected:
  tile::Map map(const test::SyntheticMap& synthetic) const {
    test::write_map(synthetic, folder.file("m.tif"));
    return tile::Map::open(folder.file("m.tif")).value();
  }
  static Scene scene(const tile::Map& map, LayerOptions options = {}) {
    return Scene::plane(map.center(), {}).with_layer("eo", map, std::move(options));
  }
  static std::set<int> values(const Frame& frame) {
    const auto pixels = frame.pixels<std::uint8_t>();
    return {pixels.begin(), pixels.end()};
  }

  test::TemporaryFolder folder;
  const Camera camera = test::square_camera(256, 256);
};

TEST_F(Coarse, AColdFrameShowsTheCoarsestLevelAndTheNextOneIsWhole) {
  const auto m = map(level_map({2, 4, 8, 16}));
  const Scene s = scene(m);
  const CameraPose pose = test::over_centre(m, 256);
  const Frame normal = Renderer().render(s, camera, pose).value();
  EXPECT_FALSE(normal.truth().coarse);
  ASSERT_EQ(values(normal), std::set{10});

  Renderer renderer;
  const Frame cold = renderer.render(s, camera, pose, coarse).value();
  EXPECT_EQ(values(cold), std::set{50});
  EXPECT_EQ(cold.truth().coarse->fraction, 1);
  EXPECT_EQ(cold.truth().coarse->levels, 4);
  EXPECT_EQ(cold.truth().finest_level, 4) << "what the record tells is what was sampled";
  EXPECT_EQ(cold.truth().coarsest_level, 4);
  EXPECT_EQ(cold.truth().valid_fraction, 1);

  renderer.wait_for_prefetch();
  const Frame warm = renderer.render(s, camera, pose, coarse).value();
  EXPECT_EQ(warm.counters().windows_read, 0);
  EXPECT_EQ(warm.layer().samples, normal.layer().samples);
  EXPECT_EQ(warm.layer().validity, normal.layer().validity);
  EXPECT_EQ(warm.truth().coarse->fraction, 0);
  EXPECT_EQ(warm.truth().coarse->levels, 0);
  EXPECT_EQ(warm.truth().finest_level, 0);
}

TEST_F(Coarse, BlocksWhoseCellsAreThereAreSampledAsPlannedAndTheOthersFromTheFinestLevelThatIs) {
  const auto m = map(level_map({2, 4, 8, 16}));
  const Scene s = scene(m);
  Renderer renderer;
  // Level 2 of all of the view, and level 0 of a part of it
  auto ticket =
      renderer.prefetch(s, test::square_camera(256, 256), test::over_centre(m, 4 * 256), {.quality = Quality::draft});
  const auto small = renderer.prefetch(s, test::square_camera(32, 256), test::over_centre(m, 256));
  renderer.wait_for_prefetch();
  geodesy::Geodetic place = m.center();
  place.lon_rad += 70 / (6378137 * std::cos(place.lat_rad));
  place.height_m = 256;
  const Frame frame = renderer.render(s, camera, look_down(place, geodesy::Degrees{0}), coarse).value();
  EXPECT_EQ(values(frame), (std::set{10, 30}));
  EXPECT_EQ(frame.truth().coarse->levels, 2);
  const auto pixels = frame.pixels<std::uint8_t>();
  const auto from_level_2 = std::count(pixels.begin(), pixels.end(), 30);
  EXPECT_EQ(frame.truth().coarse->fraction, static_cast<double>(from_level_2) / static_cast<double>(pixels.size()));
  EXPECT_EQ(frame.counters().passes, 1);
}

TEST_F(Coarse, WhatIsTwoLevelsCoarserIsThereBeforeAllElse) {
  const auto m = map(level_map({2, 4, 8, 16}));
  const Scene s = scene(m);
  Renderer renderer({.cache_bytes = 1 << 20});  // 16 cells with GDAL's part: level 0 of the view has 121
  const Camera wide = test::square_camera(1280, 1280);
  const Frame cold = renderer.render(s, wide, test::over_centre(m, 1280), coarse).value();
  ASSERT_EQ(values(cold), std::set{50});
  renderer.wait_for_prefetch();
  const Frame next = renderer.render(s, wide, test::over_centre(m, 1280), coarse).value();
  EXPECT_GT(next.truth().coarse->fraction, 0) << "more than the memory holds";
  EXPECT_EQ(next.truth().valid_fraction, 1);
  EXPECT_LE(renderer.cache_counters().peak_bytes, 1u << 20);
}

TEST_F(Coarse, AMapOfOneLevelWaitsAndOneOfTwoHasItsSecond) {
  for (const int levels : {1, 2}) {
    const auto m = map(level_map(levels == 1 ? std::vector<int>{} : std::vector{2}));
    const Frame cold = Renderer().render(scene(m), camera, test::over_centre(m, 256), coarse).value();
    EXPECT_EQ(values(cold), std::set{10 * levels});
    EXPECT_EQ(cold.truth().coarse->levels, levels - 1);
    EXPECT_EQ(cold.truth().coarse->fraction, levels - 1);
  }
}

TEST_F(Coarse, LabelsAreCoarseOnlyWhereTheMapSaysThatItHoldsThem) {
  for (const bool says : {false, true}) {
    auto synthetic = level_map({2, 4, 8});
    if (says) synthetic.role = "labels";
    const auto m = map(synthetic);
    const Frame cold =
        Renderer().render(scene(m, {.role = tile::Role::Labels}), camera, test::over_centre(m, 256), coarse).value();
    EXPECT_EQ(values(cold), std::set{says ? 40 : 10});
    EXPECT_EQ(cold.truth().coarse->fraction, says ? 1 : 0);
    EXPECT_EQ(cold.truth().filter, Filter::Nearest);
  }
}

TEST_F(Coarse, EveryFilterAndSurfaceFindsItsCellsAcrossTheEndsOfTheWorld) {
  test::SyntheticMap world = level_map({2, 4, 8});
  world.width = 4096;
  world.height = 2048;
  world.crs = "EPSG:4326";
  world.geotransform = {-180, 360.0 / 4096, 0, 90, 0, -360.0 / 4096};
  const auto m = map(world);
  const auto place = geodesy::Geodetic::degrees(10, 179.5, 800e3);
  const Scene s = Scene::ellipsoid(geodesy::Geodetic::degrees(10, 180, 0), 0).with_layer("eo", m);
  for (const Filter filter : {Filter::Nearest, Filter::Bilinear, Filter::Bicubic, Filter::Mip}) {
    RenderOptions options = coarse;
    options.filter = filter;
    Renderer renderer;
    const auto pose = camera_pose(place, geodesy::YawPitchRoll::degrees(20, 10, 0));
    const Frame cold = renderer.render(s, camera, pose, options).value();
    EXPECT_EQ(values(cold), std::set{40}) << to_string(filter);
    EXPECT_EQ(cold.truth().valid_fraction, 1) << to_string(filter);
    renderer.wait_for_prefetch();
    options.allow_coarse = false;
    const Frame normal = Renderer().render(s, camera, pose, options).value();
    options.allow_coarse = true;
    EXPECT_EQ(renderer.render(s, camera, pose, options).value().layer().samples, normal.layer().samples);
  }
}

TEST_F(Coarse, FramesOfAnExposureTellTheirCoarsestInstant) {
  const auto m = map(level_map({2, 4, 8}));
  const Scene s = scene(m);
  CameraPose end = test::over_centre(m, 256);
  end.origin += 40 * Eigen::Vector3d(-std::sin(m.center().lon_rad), std::cos(m.center().lon_rad), 0);
  const auto motion = CameraMotion::through({{-0.1, test::over_centre(m, 256)}, {0.1, end}}).value();
  const Shutter shutter{.exposure_s = 0.1};
  const Frame normal = Renderer().render(s, camera, motion, shutter, {}).value();
  Renderer renderer;
  const Frame cold = renderer.render(s, camera, motion, shutter, coarse).value();
  EXPECT_GT(cold.truth().exposure->poses, 3);
  EXPECT_EQ(cold.truth().coarse->fraction, 1);
  EXPECT_EQ(cold.truth().coarse->levels, 3);
  renderer.wait_for_prefetch();
  const Frame warm = renderer.render(s, camera, motion, shutter, coarse).value();
  EXPECT_EQ(warm.truth().coarse->fraction, 0) << "what any instant missed was loaded";
  EXPECT_EQ(warm.layer().samples, normal.layer().samples);
}

/// Overwrites a tile of a level, of a compressed map.
void damage(const std::string& path, int level, int col, int row) {
  GDALAllRegister();
  const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(path.c_str()));
  GDALRasterBand* band = dataset->GetRasterBand(1);
  if (level > 0) band = band->GetOverview(level - 1);
  const std::string item = "BLOCK_OFFSET_" + std::to_string(col) + "_" + std::to_string(row);
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(std::stoll(band->GetMetadataItem(item.c_str(), "TIFF")));
  file << std::string(40, '\xff');
}

TEST_F(Coarse, DamagedTilesStandForNothingFinerAndAreInvalidWhereTheyArePlanned) {
  test::SyntheticMap synthetic = level_map({});
  synthetic.value = [](int, int, int col, int row) { return 100 + (col + row) % 50; };
  test::write_map(synthetic, folder.file("source.tif"));
  pyramid::BuildOptions build;
  build.sources = {folder.file("source.tif")};
  build.output = folder.file("built.tif");
  ASSERT_TRUE(pyramid::build(build));
  const auto shape = tile::Map::open(folder.file("built.tif")).value();
  ASSERT_GE(shape.levels().size(), 3u);
  const int tile = shape.levels()[0].tile_width, middle = 1024 / tile;
  damage(folder.file("built.tif"), 0, middle, middle);
  damage(folder.file("built.tif"), 1, 512 / tile, 512 / tile);
  const auto m = tile::Map::open(folder.file("built.tif")).value();
  const Scene s = scene(m);
  const CameraPose pose = test::over_centre(m, 256);
  const Frame normal = Renderer().render(s, camera, pose).value();
  ASSERT_LT(normal.truth().valid_fraction, 1);
  ASSERT_EQ(normal.truth().damage.size(), 1u);

  Renderer renderer;
  const auto level_1 =
      renderer.prefetch(s, test::square_camera(300, 300), test::over_centre(m, 2 * 300), {.quality = Quality::draft});
  renderer.wait_for_prefetch();
  const Frame cold = renderer.render(s, camera, pose, coarse).value();
  EXPECT_EQ(cold.truth().valid_fraction, 1) << "a level whose tile is damaged stands for no finer one";
  EXPECT_EQ(cold.truth().damage, std::vector<std::string>{});
  renderer.wait_for_prefetch();
  const Frame warm = renderer.render(s, camera, pose, coarse).value();
  EXPECT_EQ(warm.layer().samples, normal.layer().samples);
  EXPECT_EQ(warm.layer().validity, normal.layer().validity);
  EXPECT_EQ(warm.truth().damage, normal.truth().damage);
  EXPECT_EQ(warm.truth().coarse->fraction, 0);
}

TEST_F(Coarse, TheExpectedErrorIsThatOfTheLevelsSampled) {
  pyramid::BuildOptions build;
  build.sources = {NADIR_SOURCE_DIR "/sim/demo/maps/kampala.tif"};
  build.output = folder.file("built.tif");
  ASSERT_TRUE(pyramid::build(build));
  const auto m = tile::Map::open(folder.file("built.tif")).value();
  const Scene s = scene(m, {.bands = {1, 2, 3}});
  const CameraPose pose = test::over_centre(m, 256 * m.texel_size_m().x());
  Renderer renderer;
  const double cold = *renderer.render(s, camera, pose, coarse).value().truth().expected_rmse;
  renderer.wait_for_prefetch();
  const double warm = *renderer.render(s, camera, pose, coarse).value().truth().expected_rmse;
  EXPECT_GT(cold, 3 * warm);
  EXPECT_EQ(warm, *renderer.render(s, camera, pose).value().truth().expected_rmse);
}

}  // namespace
}  // namespace nadir::render

// What a frame says of its making agrees with what was counted.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

class Explained : public testing::Test {
 protected:
  Explained() {
    test::SyntheticMap synthetic = test::utm_map(1024, 1);
    synthetic.type = GDT_Byte;
    synthetic.bands = 2;
    synthetic.factors = {2, 4, 8};
    synthetic.value = [](int, int, int col, int row) { return (col + row) % 200; };
    test::write_map(synthetic, folder.file("m.tif"));
    map.emplace(tile::Map::open(folder.file("m.tif")).value());
    scene.emplace(Scene::plane(map->center(), {}).with_layer("a", *map, {.bands = {2}}));
  }
  Frame render(const Scene& of, double pitch_deg, const RenderOptions& options) {
    geodesy::Geodetic place = map->center();
    place.height_m = 300;
    return renderer
        .render(of, test::square_camera(256, 250), camera_pose(place, geodesy::YawPitchRoll::degrees(0, pitch_deg, 0)),
                options)
        .value();
  }

  test::TemporaryFolder folder;
  std::optional<tile::Map> map;
  std::optional<Scene> scene;
  Renderer renderer;
};

TEST_F(Explained, PixelsSamplesAndCellsAreThoseOfTheFrame) {
  for (const Quality quality : {Quality::draft, Quality::balanced, Quality::best}) {
    // Ground off the map, and on it several levels
    const Frame frame = render(*scene, 50, {.quality = quality, .explain = true});
    const Explanation& explanation = frame.explanation();
    ASSERT_EQ(explanation.layers.size(), 1u);
    const LayerExplanation& layer = explanation.layers[0];
    EXPECT_EQ(layer.name, "a");
    EXPECT_EQ(layer.map, folder.file("m.tif"));
    EXPECT_EQ(layer.bands, 1);
    EXPECT_EQ(layer.bands_of_map, 2);
    EXPECT_EQ(layer.pixels_sampled + layer.pixels_no_ground + layer.pixels_off_map, 256 * 256);
    EXPECT_GT(layer.pixels_off_map, 0);
    EXPECT_EQ(layer.samples, frame.counters().samples);
    EXPECT_EQ(layer.cells, frame.counters().cells);
    EXPECT_EQ(layer.cell_bytes, static_cast<std::uint64_t>(layer.cells) *
                                    tile::CellSource::make(*map, {2}, tile::Domain::Linear).value()->cell_bytes());
    EXPECT_EQ(layer.filter, frame.truth().filter);
    EXPECT_EQ(layer.mapping_error_px, frame.truth().geometry_error_px);
    ASSERT_GE(layer.levels.size(), quality == Quality::draft ? 2u : 1u);
    EXPECT_EQ(layer.levels.front().level, frame.truth().finest_level);
    EXPECT_EQ(layer.levels.back().level, frame.truth().coarsest_level);
    const auto total = [&](auto LevelUse::*what) {
      return std::accumulate(layer.levels.begin(), layer.levels.end(), std::int64_t{0},
                             [&](std::int64_t sum, const LevelUse& use) { return sum + use.*what; });
    };
    if (quality == Quality::draft) {  // each block has one level
      EXPECT_EQ(total(&LevelUse::blocks), layer.blocks);
      EXPECT_EQ(total(&LevelUse::pixels), layer.pixels_sampled);
    } else {
      EXPECT_GE(total(&LevelUse::pixels), layer.pixels_sampled);
      EXPECT_LE(total(&LevelUse::pixels), 2 * layer.pixels_sampled);
    }
  }
}

TEST_F(Explained, AFrameThatNobodyAsksAboutExplainsNothing) {
  EXPECT_TRUE(render(*scene, 0, {}).explanation().layers.empty());
}

TEST_F(Explained, ASecondLayerOfTheSameCrsSharesItsMapping) {
  const Frame frame = render(scene->with_layer("b", *map), 0, {.explain = true});
  ASSERT_EQ(frame.explanation().layers.size(), 2u);
  EXPECT_FALSE(frame.explanation().layers[0].mapping_shared);
  EXPECT_TRUE(frame.explanation().layers[1].mapping_shared);
  EXPECT_EQ(frame.explanation().layers[1].homographies, frame.explanation().layers[0].homographies);
}

TEST_F(Explained, AViewOfNothingSamplesNothing) {
  const Frame frame = render(*scene, 180, {.explain = true});  // up
  const LayerExplanation& layer = frame.explanation().layers.at(0);
  EXPECT_EQ(layer.pixels_no_ground, 256 * 256);
  EXPECT_EQ(layer.blocks, 0);
  EXPECT_TRUE(layer.levels.empty());
  EXPECT_EQ(layer.samples_a_pixel(), 0);
}

TEST_F(Explained, StagesAddUpToNoMoreThanTheFrame) {
  const Frame frame = render(*scene, 0, {});
  const StageTimes& times = frame.counters().times;
  double sum = 0;
  for (const Stage& stage : stages) {
    EXPECT_GT(times.*stage.ms, 0) << stage.name;
    if (stage.ms != &StageTimes::whole_ms) sum += times.*stage.ms;
  }
  EXPECT_LE(sum, times.whole_ms * (1 + 1e-9));
  EXPECT_EQ(times.whole_ms, frame.truth().render_ms);
}

TEST_F(Explained, LinesAreTheSameForTheSameFrameWhateverItsTimes) {
  render(*scene, 60, {});  // reads the map
  const auto first = to_text(render(*scene, 60, {.explain = true}).explanation());
  const auto second = to_text(render(*scene, 60, {.explain = true}).explanation());
  EXPECT_EQ(first.done, second.done);
  EXPECT_EQ(first.left_out, second.left_out);
  EXPECT_GE(first.done.size(), 4u);
  EXPECT_EQ(to_text(StageTimes{.planning_ms = 1, .sampling_ms = 7.5, .whole_ms = 10}),
            "10 ms: preparing 0 ms (0.0 %), mapping 0 ms (0.0 %), planning 1 ms (10.0 %), reading 0 ms (0.0 %), "
            "sampling 7.5 ms (75.0 %), finishing 0 ms (0.0 %)");
}

}  // namespace
}  // namespace nadir::render

// A pyramid whose level k holds the constant k renders the level of detail itself.
#include <gtest/gtest.h>

#include <cmath>

#include "nadir/render/layer_plan.h"
#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

class Levels : public testing::Test {
 protected:
  Levels() {
    test::SyntheticMap synthetic = test::utm_map(4096, 1);
    synthetic.factors = {2, 4, 8, 16, 32};
    synthetic.value = [](int level, int, int, int) { return level; };
    test::write_map(synthetic, folder.file("m.tif"));
    map.emplace(tile::Map::open(folder.file("m.tif")).value());
    scene.emplace(Scene::plane(map->center(), {}).with_layer("k", *map));
  }
  Frame render(const Camera& camera, const CameraPose& pose, const RenderOptions& options) {
    return renderer.render(*scene, camera, pose, options).value();
  }

  test::TemporaryFolder folder;
  std::optional<tile::Map> map;
  std::optional<Scene> scene;
  Renderer renderer;
};

TEST_F(Levels, FollowTheFootprintFromOneTexelToTheCoarsest) {
  // f = 200 px: a pixel spans height / 200 texels. The map's scale on its axis is 0.9996 and 1.0 along and across: 2e-3
  // in levels.
  const Camera camera = test::square_camera(128, 200);
  for (const double texels : {0.5, 1.0, 1.41, 2.0, 3.0, 5.7, 8.0, 20.0}) {
    const Frame frame = render(camera, test::over_centre(*map, 200 * texels), {.oversampling = 1, .level_blend = 1});
    const double expected = std::max(0.0, std::log2(texels));
    for (const float value : frame.pixels<float>()) {
      if (!std::isfinite(value)) continue;  // off the map
      ASSERT_NEAR(value, expected, 5e-3) << texels << " texels a pixel";
    }
    const Frame draft = render(camera, test::over_centre(*map, 200 * texels), {.quality = Quality::draft});
    ASSERT_NEAR(draft.pixels<float>()[64 * 128 + 64], std::round(expected),
                std::abs(expected - std::floor(expected) - 0.5) < 0.01 ? 1 : 1e-6);
    const Frame best = render(camera, test::over_centre(*map, 200 * texels), {.oversampling = 2, .level_blend = 1});
    ASSERT_NEAR(best.pixels<float>()[64 * 128 + 64], std::max(0.0, expected - 1), 5e-3)
        << "two samples across halve what each stands for";
  }
}

TEST(Qualities, BestTakesCubicSamplesWherePixelsSpanATexelAndMeansElsewhere) {
  const test::TemporaryFolder folder;
  test::SyntheticMap synthetic = test::utm_map(512, 1);
  synthetic.factors = {2, 4};
  synthetic.value = [](int level, int, int col, int row) { return 100 * std::sin(0.9 * col + 0.4 * row) + level; };
  test::write_map(synthetic, folder.file("m.tif"));
  const auto map = tile::Map::open(folder.file("m.tif")).value();
  const Scene scene = Scene::plane(map.center(), {}).with_layer("k", map);
  Renderer renderer;
  const auto samples = [&](double texels, const RenderOptions& options) {
    return renderer.render(scene, test::square_camera(64, 200), test::over_centre(map, 200 * texels), options)
        .value()
        .layer()
        .samples;
  };
  const RenderOptions best{.quality = Quality::best}, cubic{.filter = Filter::Bicubic};
  for (const double texels : {0.3, 1.0, 1.15}) EXPECT_EQ(samples(texels, best), samples(texels, cubic)) << texels;
  EXPECT_EQ(samples(2, best), samples(2, {.filter = Filter::Mip, .oversampling = 3.1, .level_blend = 0.25}));
  EXPECT_NE(samples(1, {.quality = Quality::balanced}), samples(1, cubic));
}

TEST_F(Levels, ObliqueViewsShowNoSeam) {
  const Camera camera = test::square_camera(512, 500);
  geodesy::Geodetic place = map->center();
  place.height_m = 900;
  for (const double pitch : {45.0, 60.0}) {
    const Frame frame = render(camera, camera_pose(place, geodesy::YawPitchRoll::degrees(30, pitch, 10)),
                               {.oversampling = 1, .level_blend = 1});
    const auto pixels = frame.pixels<float>();
    double largest_step = 0, highest = 0;
    for (int y = 0; y + 1 < 512; ++y)
      for (int x = 0; x + 1 < 512; ++x) {
        const float here = pixels[static_cast<std::size_t>(y * 512 + x)];
        for (const float next :
             {pixels[static_cast<std::size_t>(y * 512 + x + 1)], pixels[static_cast<std::size_t>((y + 1) * 512 + x)]})
          if (std::isfinite(here) && std::isfinite(next))
            largest_step = std::max<double>(largest_step, std::abs(here - next));
        if (std::isfinite(here)) highest = std::max<double>(highest, here);
      }
    EXPECT_GT(highest, 0.8) << "the view no longer spans levels";
    // The level is linear in the logarithm of range: from pixel to pixel it changes by a few thousandths. A seam
    // between levels chosen by block would be a step of one, one in the interpolation of corners of about a tenth.
    EXPECT_LT(largest_step, 0.03) << "pitch " << pitch;
  }
}

TEST_F(Levels, ALevelNotSampledIsNotRead) {
  const Frame frame =
      render(test::square_camera(128, 200), test::over_centre(*map, 200 * 8.0), {.quality = Quality::draft});
  EXPECT_EQ(frame.truth().finest_level, 3);
  EXPECT_EQ(frame.truth().coarsest_level, 3);
  // 128 pixels of 8 texels over cells of 128 at level 3: two by two cells around the middle, with their neighbours'
  // texels.
  EXPECT_LE(frame.counters().cells_loaded, 4);
}

TEST_F(Levels, OutsideOfTheBandOfBlendingABlockHasOneLevel) {
  const auto source = tile::CellSource::make(*map, {}, tile::Domain::Linear).value();
  const Eigen::Affine2d crs_from_texel = map->texel_from_crs().inverse();
  for (int tenths = 1; tenths < 20; ++tenths) {
    PatchMapping mapping;
    Patch& patch = mapping.patches.emplace_back();
    patch.kind = Patch::Kind::Homography;
    patch.rect = {0, 0, 64, 64};
    patch.crs_from_image.topLeftCorner<2, 2>() = crs_from_texel.linear() * std::exp2(tenths / 10.0);
    patch.crs_origin = crs_from_texel * Eigen::Vector2d(1000, 1000);
    const LayerPlan plan = plan_layer(mapping, *source, {.filter = Filter::Mip, .level_blend = 0.25});
    ASSERT_EQ(plan.blocks.size(), 1u);
    const auto& windows = plan.blocks[0].windows;
    const bool blended = tenths % 10 > 3 && tenths % 10 < 7;  // within an eighth of the half-way point
    EXPECT_EQ(windows.size(), blended ? 2u : 1u) << tenths;
    EXPECT_EQ(windows[0].level, blended ? tenths / 10 : (tenths + 5) / 10) << tenths;
  }
}

}  // namespace
}  // namespace nadir::render

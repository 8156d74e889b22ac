#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

class Determinism : public testing::Test {
 protected:
  Determinism() {
    test::write_map(test::busy_map(), folder.file("m.tif"));
    const auto map = tile::Map::open(folder.file("m.tif")).value();
    scene.emplace(Scene::plane(map.center(), {}).with_layer("eo", map));
    geodesy::Geodetic place = map.center();
    place.height_m = 700;
    pose = camera_pose(place, geodesy::YawPitchRoll::degrees(33, 50, 8));
  }
  Frame render(const RendererOptions& options) {
    return Renderer(options)
        .render(*scene, Camera::pinhole(500, 300, 400, 400, 250, 150).value(), pose, {.quality = Quality::best})
        .value();
  }

  test::TemporaryFolder folder;
  std::optional<Scene> scene;
  CameraPose pose;
};

TEST_F(Determinism, TheSameBytesForAnyThreadCountBudgetAndHistory) {
  const Frame reference = render({.threads = 1});
  ASSERT_GT(reference.truth().valid_fraction, 0.2);
  ASSERT_LT(reference.truth().valid_fraction, 1);
  for (const RendererOptions& options : {RendererOptions{.threads = 2}, RendererOptions{.threads = 7},
                                         RendererOptions{.cache_bytes = 3 << 20, .threads = 2}}) {
    Renderer renderer(options);
    for (int turn = 0; turn < 2; ++turn) {
      const Frame frame =
          renderer
              .render(*scene, Camera::pinhole(500, 300, 400, 400, 250, 150).value(), pose, {.quality = Quality::best})
              .value();
      EXPECT_EQ(frame.layer().samples, reference.layer().samples);
      EXPECT_EQ(frame.layer().validity, reference.layer().validity);
    }
  }
}

TEST_F(Determinism, ASmallBudgetTakesPassesAndIsKept) {
  constexpr std::uint64_t budget = 2 << 20;
  Renderer renderer({.cache_bytes = budget});
  const Frame frame = renderer.render(*scene, Camera::pinhole(500, 300, 400, 400, 250, 150).value(), pose).value();
  EXPECT_GT(frame.counters().passes, 1);
  EXPECT_LE(renderer.cache_counters().peak_bytes, budget);
}

TEST_F(Determinism, ABudgetBelowOneBlocksTilesIsRefusedWithAdvice) {
  Renderer renderer({.cache_bytes = 64 << 10});
  const auto frame = renderer.render(*scene, Camera::pinhole(500, 300, 400, 400, 250, 150).value(), pose);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, Error::Kind::OverBudget);
  EXPECT_NE(frame.error().message.find("allow more memory"), std::string::npos);
}

TEST_F(Determinism, FramesRenderedAtTheSameTimeAreTheSame) {
  const Frame reference = render({});
  Renderer renderer;
  std::vector<std::thread> threads;
  std::atomic<int> same{0};
  for (int i = 0; i < 3; ++i)
    threads.emplace_back([&] {
      const auto frame = renderer.render(*scene, Camera::pinhole(500, 300, 400, 400, 250, 150).value(), pose,
                                         {.quality = Quality::best});
      same += frame && frame->layer().samples == reference.layer().samples;
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(same, 3);
}

}  // namespace
}  // namespace nadir::render

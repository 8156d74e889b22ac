#include "nadir/render/frame_memory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "support/scene.h"
#include "support/temporary_folder.h"

namespace nadir::render {
namespace {

TEST(FrameMemory, ABlockOfTheSameSizeIsTakenOverAndNoOther) {
  FrameMemory memory(1 << 20);
  void* const block = memory.take(1000);
  memory.give_back(block, 1000);
  void* const other = memory.take(1001);
  EXPECT_NE(other, block);
  void* const again = memory.take(1000);
  EXPECT_EQ(again, block);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(again) % 64, 0u);
  EXPECT_EQ(memory.counters().blocks_taken, 3);
  EXPECT_EQ(memory.counters().blocks_recycled, 1);
  memory.give_back(again, 1000);
  memory.give_back(other, 1001);
}

TEST(FrameMemory, KeepsNoMoreThanItsBoundAndForgetsTheOldestFirst) {
  FrameMemory memory(250);
  void *const a = memory.take(100), *const b = memory.take(120), *const c = memory.take(110),
              *const d = memory.take(300);
  EXPECT_EQ(memory.counters().used_bytes, 630u);
  memory.give_back(d, 300);
  EXPECT_EQ(memory.counters().spare_bytes, 0u) << "larger than the bound";
  memory.give_back(a, 100);
  memory.give_back(b, 120);
  memory.give_back(c, 110);
  EXPECT_EQ(memory.counters().used_bytes, 0u);
  EXPECT_EQ(memory.counters().spare_bytes, 230u) << "the first one is gone";
  EXPECT_EQ(memory.counters().peak_bytes, 630u);
}

TEST(FrameMemory, BuffersOutliveTheRendererTheyCameFrom) {
  auto memory = std::make_shared<FrameMemory>(1 << 20);
  FrameBuffer<std::byte> buffer{FrameAllocator<std::byte>(memory)};
  buffer.resize(5000);
  const std::weak_ptr<FrameMemory> watch = memory;
  memory.reset();
  EXPECT_FALSE(watch.expired());
  std::memset(buffer.data(), 1, buffer.size());
  const FrameBuffer<std::byte> copy = buffer;
  EXPECT_EQ(copy, buffer);
  EXPECT_EQ(copy.get_allocator(), buffer.get_allocator());
  EXPECT_EQ(FrameBuffer<std::byte>(3, std::byte{2}), std::vector<std::byte>(3, std::byte{2}));
}

/// Frames of one renderer, each after one of other pixels that left its memory behind, beside those of new ones.
class RecycledFrames : public testing::Test {
 protected:
  tile::Map map(const std::string& name, GDALDataType type) {
    test::SyntheticMap synthetic = test::busy_map();
    synthetic.type = type;
    test::write_map(synthetic, folder.file(name));
    return tile::Map::open(folder.file(name)).value();
  }
  static CameraPose over(const tile::Map& map, double pitch_deg) {
    geodesy::Geodetic place = map.center();
    place.height_m = 600;
    return camera_pose(place, geodesy::YawPitchRoll::degrees(20, pitch_deg, 3));
  }
  static std::vector<std::byte> bytes(const Frame& frame) {
    std::vector<std::byte> all;
    for (const FrameLayer& layer : frame.layers()) {
      all.insert(all.end(), layer.samples.begin(), layer.samples.end());
      for (const std::uint8_t valid : layer.validity) all.push_back(std::byte{valid});
    }
    return all;
  }

  /// From all valid to nearly nothing and back, with what lies between.
  void compare(const Scene& scene, const tile::Map& map, const RenderOptions& options) {
    const Camera camera = Camera::pinhole(300, 200, 260, 260, 150, 100).value();
    Renderer renderer({.threads = 2});
    for (const double pitch_deg : {0.0, 50.0, 85.0, 120.0, 30.0, 95.0}) {
      const CameraPose pose = over(map, pitch_deg);
      const auto found = bytes(renderer.render(scene, camera, pose, options).value());
      const auto expected =
          bytes(Renderer({.threads = 2, .spare_frame_bytes = 0}).render(scene, camera, pose, options).value());
      EXPECT_TRUE(found == expected) << "pitch " << pitch_deg;

      std::vector<std::byte> samples;
      const auto sink = [&](const Frame& band, int) -> Result<void> {
        samples.insert(samples.end(), band.layer().samples.begin(), band.layer().samples.end());
        return {};
      };
      ASSERT_TRUE(renderer.render_bands(scene, camera, pose, options, 70, sink));
      ASSERT_LE(samples.size(), expected.size());
      EXPECT_TRUE(std::equal(samples.begin(), samples.end(), expected.begin())) << "in bands, pitch " << pitch_deg;
    }
    const FrameMemoryCounters counters = renderer.frame_memory_counters();
    EXPECT_GT(counters.blocks_recycled, 8) << "nothing was taken over: this shows nothing";
    EXPECT_EQ(counters.used_bytes, 0u);
  }

  test::TemporaryFolder folder;
};

TEST_F(RecycledFrames, ShowNothingOfThoseBeforeMaskedOrFilled) {
  const tile::Map m = map("m.tif", GDT_Byte);
  const Scene scene = Scene::plane(m.center(), {}).with_layer("eo", m);
  for (const Quality quality : {Quality::draft, Quality::best})
    for (const OffMap off_map : {OffMap::Mask, OffMap::Fill})
      compare(scene, m, {.quality = quality, .off_map = off_map, .fill_value = 77});
}

TEST_F(RecycledFrames, ShowNothingOfThoseBeforeInFloatsAndConvertedOnes) {
  const tile::Map m = map("f.tif", GDT_Float32);
  compare(Scene::plane(m.center(), {}).with_layer("eo", m), m, {});
  const Output output{tile::SampleType::UInt8, 0, 250};
  compare(Scene::plane(m.center(), {}).with_layer("eo", m, {.output = output}), m, {});
}

TEST_F(RecycledFrames, ShowNothingOfThoseBeforeWhereLevelsStandForOthers) {
  const tile::Map m = map("m.tif", GDT_Byte);
  const Scene scene = Scene::plane(m.center(), {}).with_layer("eo", m);
  const Camera camera = Camera::pinhole(300, 200, 260, 260, 150, 100).value();
  Renderer renderer({.threads = 2});
  for (const double pitch_deg : {0.0, 60.0, 95.0, 20.0}) {
    const RenderOptions coarse{.off_map = OffMap::Fill, .fill_value = 9, .allow_coarse = true};
    renderer.render(scene, camera, over(m, pitch_deg), coarse).value();
    renderer.wait_for_prefetch();
    const Frame warm = renderer.render(scene, camera, over(m, pitch_deg), coarse).value();
    const Frame expected =
        Renderer().render(scene, camera, over(m, pitch_deg), {.off_map = OffMap::Fill, .fill_value = 9}).value();
    EXPECT_EQ(bytes(warm), bytes(expected)) << "pitch " << pitch_deg;
  }
}

TEST_F(RecycledFrames, ShowNothingOfThoseBeforeInMotion) {
  const tile::Map m = map("m.tif", GDT_Byte);
  const Scene scene = Scene::plane(m.center(), {}).with_layer("eo", m);
  const Camera camera = Camera::pinhole(150, 100, 130, 130, 75, 50).value();
  const Shutter shutter{.exposure_s = 0.02};
  Renderer renderer({.threads = 2});
  for (const double pitch_deg : {0.0, 60.0, 80.0}) {
    CameraPose later = over(m, pitch_deg);
    later.origin += Eigen::Vector3d(300, -200, 100);
    const CameraMotion motion = CameraMotion::through({{0, over(m, pitch_deg)}, {1, later}}).value();
    EXPECT_EQ(bytes(renderer.render(scene, camera, motion, shutter).value()),
              bytes(Renderer({.spare_frame_bytes = 0}).render(scene, camera, motion, shutter).value()));
  }
}

}  // namespace
}  // namespace nadir::render

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "aims.h"
#include "contestants.h"
#include "flight_cases.h"
#include "ideal.h"
#include "support/temporary_folder.h"

namespace nadir::bench {
namespace {

TEST(KnownContent, MeansOfParallelogramsAreThoseOfManyPoints) {
  const KnownContent scene(256, 3, 8, 247);
  Eigen::Matrix2d sides;
  sides << 3.1, -0.7, 1.2, 2.4;
  const Eigen::Vector2d centre(-31.3, 500.9);
  constexpr int n = 256;
  std::array<double, KnownContent::most_bands> sum{};
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d at = centre + sides * Eigen::Vector2d((i + 0.5) / n - 0.5, (j + 0.5) / n - 0.5);
      const auto point = scene.mean(at, Eigen::Matrix2d::Zero());
      for (std::size_t b = 0; b < sum.size(); ++b) sum[b] += point[b] / (n * n);
    }
  const auto mean = scene.mean(centre, sides);
  // The midpoint rule errs by (pi t / n)^2 / 6 of a wave that makes t turns along a side: at most 4.3 turns here, and
  // all waves together swing by less than 400.
  const double bound = 400 * 2 * std::pow(std::numbers::pi * 4.3 / n, 2) / 6;
  for (std::size_t b = 0; b < 3; ++b) {
    EXPECT_NEAR(mean[b], sum[b], bound);
    EXPECT_GT(std::abs(mean[b] - scene.mean(centre, Eigen::Matrix2d::Zero())[b]), 2 * bound) << "nothing is averaged";
  }
}

TEST(KnownContent, TexelsAreMeansInTheRangeThatIsAskedForAndRepeat) {
  const KnownContent scene(64, 2, 8, 247);
  const auto texels = scene.texels(false);
  const auto [least, most] = std::minmax_element(texels.begin(), texels.end());
  EXPECT_NEAR(*least, 8, 1e-3);
  EXPECT_NEAR(*most, 247, 1e-3);
  for (const int turn : {0, -64, 640})
    for (const int x : {0, 5, 63})
      EXPECT_NEAR(scene.mean({x + 0.5 + turn, 7.5 - turn}, Eigen::Matrix2d::Identity())[1],
                  texels[static_cast<std::size_t>((7 * 64 + x) * 2 + 1)], 1e-3);
}

/// A camera whose pixels are the map's texels from (10, 20) on.
View one_to_one() {
  return {.name = "v", .width = 6, .height = 4, .map_pixel_from_image_pixel = {1, 0, 10, 0, 1, 20, 0, 0, 1}};
}

TEST(Ideal, APixelOnATexelIsTheBilinearMapsMeanOverIt) {
  const MapContent map = MapContent::make(64, 1, SampleType::f32);
  const View view = one_to_one();
  const Ideal ideal = ideal_of(view, map, rectangle(view, 2, 1, 3, 2));
  ASSERT_EQ(ideal.pixels, (std::vector<std::size_t>{8, 9, 10, 14, 15, 16}));
  // Half of the pixel lies towards either neighbour, at a quarter of the way on average: weights 1/8, 3/4, 1/8
  const auto texel = [&](int x, int y) { return map.texels[static_cast<std::size_t>(y * 64 + x)]; };
  constexpr std::array weights = {0.125, 0.75, 0.125};
  double mean = 0;
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i)
      mean +=
          weights[static_cast<std::size_t>(j + 1)] * weights[static_cast<std::size_t>(i + 1)] * texel(12 + i, 21 + j);
  EXPECT_NEAR(ideal.image[0], mean, 1e-6);
  EXPECT_NEAR(ideal.scene[0], texel(12, 21), 1e-6);
}

TEST(Ideal, DeviationsAreRmsAndMaximumAndPsnr) {
  const std::vector<std::uint8_t> frame = {10, 20, 30, 40};
  const Ideal ideal{2, 1, {0, 3}, {}, {}};
  const Deviation found = deviation(std::as_bytes(std::span(frame)), SampleType::u8, ideal, {13, 36});
  EXPECT_DOUBLE_EQ(found.rms, std::sqrt((9 + 16) / 2.0));
  EXPECT_EQ(found.max, 4);
  EXPECT_NEAR(found.psnr(255), 20 * std::log10(255 / std::sqrt(12.5)), 1e-12);
  EXPECT_TRUE(std::isinf(deviation(std::as_bytes(std::span(frame)), SampleType::u8, ideal, {10, 40}).psnr(255)));
}

TEST(Ideal, ALatticeKeepsToItsBudget) {
  const View view{.width = 320, .height = 200, .map_pixel_from_image_pixel = {8, 0, 0, 0, 8, 0, 0, 0, 1}};
  EXPECT_EQ(lattice(view, 1e9).size(), 320u * 200);
  const std::size_t pixels = lattice(view, 1e6).size();  // of 16 x 16 samples each
  EXPECT_LE(pixels * 256, 1.1e6);
  EXPECT_GE(pixels * 256, 1e5);
}

TEST(Views, ReadBackAsTheSameBits) {
  const test::TemporaryFolder folder;
  View view = one_to_one();
  view.focal_px = 1.0 / 3;
  view.camera_enu_m = {1e-300, -2, 0.1};
  ASSERT_TRUE(write_views(folder.path() / "v", {view, one_to_one()}));
  EXPECT_EQ(read_views(folder.path() / "v").value(), (std::vector<View>{view, one_to_one()}));
  EXPECT_FALSE(read_views(folder.path() / "none"));
}

TEST(Flicker, OnlyWhatIsNotTheGroundsMotionCounts) {
  constexpr int width = 64, height = 48;
  constexpr std::array motion = {1.84, -1.38};
  // Waves of 8 pixels or more, which Lanczos interpolation moves to within a level's rounding
  const auto picture = [&](double moved, int noise) {
    std::vector<std::byte> pixels;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const double u = x - motion[0] * moved, v = y - motion[1] * moved;
        pixels.push_back(static_cast<std::byte>(
            static_cast<int>(std::lround(128 + 50 * std::sin(u * 0.7) * std::cos(v * 0.3))) + (x * y % 2 ? noise : 0)));
      }
    return pixels;
  };
  EXPECT_LT(squares_of_change(picture(0, 0), picture(1, 0), width, height, 1, motion), 0.5);
  EXPECT_GT(squares_of_change(picture(0, 0), picture(1, 10), width, height, 1, motion), 10);
  EXPECT_GT(squares_of_change(picture(0, 0), picture(0, 0), width, height, 1, motion), 100) << "the motion is undone";
}

Row found(const std::string& method, const std::string& setting, double ms, double image_db, double scene_db) {
  return {.suite = "render",
          .case_name = "c",
          .method = method,
          .setting = setting,
          .wall_ms = ms,
          .counters = {{"psnr_image_db", std::to_string(image_db)}, {"psnr_scene_db", std::to_string(scene_db)}}};
}

const Aim* aim_of(const std::vector<Aim>& aims, const std::string& method, const std::string& what) {
  for (const Aim& aim : aims)
    if (aim.method == method && aim.what == what) return &aim;
  return nullptr;
}

TEST(Aims, ThePeerToBeatIsTheFastestOneOfTheSameQuality) {
  const auto aims =
      aims_of_view("n8", {found("nadir draft", "1 thread", 5, 36, 36), found("nadir balanced", "1 thread", 9, 44, 40),
                          found("nadir best", "1 thread", 20, 51, 41), found("slow", "1 thread", 30, 45, 40),
                          found("quick", "1 thread", 12, 43.5, 40), found("blurred", "1 thread", 1, 42.9, 40),
                          found("GDAL + OpenCV linear", "1 thread", 4, 36.5, 36)});
  const Aim* good = aim_of(aims, "nadir balanced, 1 thread", "43 dB");
  ASSERT_TRUE(good);
  EXPECT_EQ(good->baseline, "quick, 1 thread");
  EXPECT_EQ(good->most, 0.5);
  EXPECT_EQ(good->missed, "");
  const Aim* draft = aim_of(aims, "nadir draft, 1 thread", "");
  ASSERT_TRUE(draft);
  EXPECT_EQ(draft->baseline, "GDAL + OpenCV linear, 1 thread");
  EXPECT_EQ(draft->missed, "36.0 dB against 36.5") << "faster but worse is no success";
}

TEST(Aims, PeersThatAreFasterAndNearerThanOurFrontAreNamed) {
  const std::vector<Row> rows = {
      found("nadir draft", "1 thread", 5, 36, 0), found("nadir balanced", "1 thread", 9, 44, 0),
      found("nadir best", "1 thread", 8, 50, 0),  // balanced is behind our own front
      found("beats draft", "1 thread", 4, 40, 0), found("beats balanced alone", "1 thread", 8.5, 45, 0),
      found("faster", "1 thread", 1, 35, 0),      found("nearer", "1 thread", 90, 60, 0),
      found("as near", "1 thread", 7, 50.01, 0),  found("of two threads", "2 threads", 1, 99, 0)};
  std::vector<std::string> beaten;
  for (const Aim& aim : aims_of_view("n1", rows))
    if (aim.what == "beaten") beaten.push_back(aim.method + " by " + aim.baseline);
  EXPECT_EQ(beaten, (std::vector<std::string>{"nadir draft, 1 thread by beats draft, 1 thread"}));
}

TEST(Contestants, AMissingPeerIsSaid) {
  // Peers lie beside nadir-bench, not beside this test
  ViewSetting setting;
  const Method method = method_of(std::make_shared<ViewSetting>(setting), contestants({"libvips bilinear"})[0], 1);
  EXPECT_NE(method.left_out.find("nadir-peer-vips was not built"), std::string::npos) << method.left_out;
}

}  // namespace
}  // namespace nadir::bench

// The definition against an evaluation of its own: in double, texel by texel, from the rule that the map follows.
#include "nadir/render/sample_block.h"

#include <gtest/gtest.h>

#include <cstring>

#include "nadir/render/homography.h"
#include "random_blocks.h"

namespace nadir::render {
namespace {

using test::MapInMemory, test::RandomBlock;

/// Sums of a pixel, and the weight of its valid texels.
struct Exact {
  std::vector<double> sums;
  double weight = 0;
};

class SlowSampler {
 public:
  SlowSampler(const MapInMemory& map, const BlockSampling& block) : map_(map), block_(block) {}

  /// Level-0 texel of a place in the block.
  Eigen::Vector2d texel_at(double x, double y) const {
    if (!block_.texels.empty()) {
      const auto col = static_cast<std::size_t>(x), row = static_cast<std::size_t>(y);
      return block_.texels[row * static_cast<std::size_t>(block_.width) + col] +
             block_.jacobian * Eigen::Vector2d(x - std::floor(x) - 0.5, y - std::floor(y) - 0.5);
    }
    if (block_.biquadratic) return block_.texel_origin + (*block_.biquadratic)(Eigen::Vector2d(x, y));
    return block_.texel_origin + apply(block_.texel_from_image, {x, y});
  }
  bool on_map(int x, int y) const {
    const Eigen::Vector2d t = texel_at(x + 0.5, y + 0.5);
    return t.x() >= 0 && t.y() >= 0 && t.x() <= block_.map_width && t.y() <= block_.map_height;
  }

  Exact pixel(int x, int y) const {
    const double right = (x + 0.5) / block_.width, down = (y + 0.5) / block_.height;
    const auto& c = block_.level_at_corner;
    const double level = (1 - down) * ((1 - right) * c[0] + right * c[1]) + down * ((1 - right) * c[3] + right * c[2]);
    const int finer = static_cast<int>(level);
    double share = level - finer;
    const double band = block_.interpolation == Interpolation::Nearest ? 0 : block_.level_blend.band;
    share = band > 0 ? std::clamp((share - 0.5) / band + 0.5, 0.0, 1.0) : share >= 0.5;
    Exact exact{std::vector<double>(static_cast<std::size_t>(map_.format.bands)), 0};
    const int nx = block_.samples_x, ny = block_.samples_y;
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const Eigen::Vector2d at = texel_at(x + (i + 0.5) / nx, y + (j + 0.5) / ny)
                                       .cwiseMax(0)
                                       .cwiseMin(Eigen::Vector2d(block_.map_width, block_.map_height));
        add(exact, std::min(finer, 2), at, (1 - share) / (nx * ny));
        add(exact, std::min(finer + 1, 2), at, share / (nx * ny));
      }
    return exact;
  }

 private:
  void add(Exact& exact, int level, const Eigen::Vector2d& at, double weight) const {
    const double size = 1 << level;
    if (block_.interpolation == Interpolation::Nearest)
      return add_texel(exact, level, std::floor(at.x() / size), std::floor(at.y() / size), weight);
    const double x = at.x() / size - 0.5, y = at.y() / size - 0.5;
    const int reach = block_.interpolation == Interpolation::Cubic ? 2 : 1;
    for (int row = 1 - reach; row <= reach; ++row)
      for (int col = 1 - reach; col <= reach; ++col)
        add_texel(exact, level, std::floor(x) + col, std::floor(y) + row,
                  weight * kernel(x - std::floor(x) - col) * kernel(y - std::floor(y) - row));
  }
  double kernel(double t) const {
    t = std::abs(t);
    if (block_.interpolation == Interpolation::Bilinear) return std::max(0.0, 1 - t);
    // Keys, 1981, equation 15
    if (t < 1) return 1.5 * t * t * t - 2.5 * t * t + 1;
    return t < 2 ? -0.5 * t * t * t + 2.5 * t * t - 4 * t + 2 : 0;
  }
  void add_texel(Exact& exact, int level, double col, double row, double weight) const {
    const int w = map_.width >> level, h = map_.height >> level;
    const int x = map_.around ? ((static_cast<int>(col) % w) + w) % w : std::clamp(static_cast<int>(col), 0, w - 1);
    const int y = std::clamp(static_cast<int>(row), 0, h - 1);
    if (!map_.valid(level, x, y)) return;
    exact.weight += weight;
    for (int b = 0; b < map_.format.bands; ++b)
      exact.sums[static_cast<std::size_t>(b)] += weight * map_.texel(level, x, y, b);
  }

  const MapInMemory& map_;
  const BlockSampling& block_;
};

template <class T>
void compare(const MapInMemory& map, const BlockSampling& block, const test::Pixels& found, double& worst,
             std::int64_t& compared) {
  constexpr bool floats = std::is_same_v<T, float>;
  constexpr double low = std::is_same_v<T, float> ? -1e30 : std::numeric_limits<T>::min(),
                   high = std::numeric_limits<T>::max();
  const T* samples = reinterpret_cast<const T*>(found.samples.data());
  const SlowSampler slow(map, block);
  for (int y = 0; y < block.height; ++y)
    for (int x = 0; x < block.width; ++x) {
      const std::size_t i =
          static_cast<std::size_t>(y) * (static_cast<std::size_t>(block.width) + 3) + static_cast<std::size_t>(x);
      const Exact exact = slow.on_map(x, y) ? slow.pixel(x, y) : Exact{};
      if (std::abs(exact.weight - 0.5) < 1e-3) continue;  // either is right
      ASSERT_EQ(found.validity[i], exact.weight > 0.5) << x << ", " << y;
      for (int b = 0; b < map.format.bands; ++b) {
        const T sample = samples[i * static_cast<std::size_t>(map.format.bands) + static_cast<std::size_t>(b)];
        if (!found.validity[i]) {
          ASSERT_EQ(sample, T{}) << "invalid pixels are 0";
          continue;
        }
        const double mean = exact.sums[static_cast<std::size_t>(b)] / exact.weight;
        const double error = std::abs(static_cast<double>(sample) - std::clamp(mean, low, high)) - (floats ? 0 : 0.5);
        worst = std::max(worst, error);
        ++compared;
      }
    }
}

class Definition : public testing::TestWithParam<tile::SampleType> {};

TEST_P(Definition, IsWhatASlowEvaluationSays) {
  for (const auto interpolation : {Interpolation::Nearest, Interpolation::Bilinear, Interpolation::Cubic}) {
    double worst[2] = {};
    std::int64_t compared = 0;
    for (const bool masked : {false, true})
      for (const bool around : {false, true}) {
        const MapInMemory map({GetParam(), around ? 3 : 1}, 300, 200, masked, around, 5);
        std::mt19937 random(static_cast<unsigned>(3 + masked));
        for (int i = 0; i < 60; ++i) {
          const RandomBlock block(map, interpolation, random);
          const test::Pixels found = test::sample(scalar_kernels(), block.sampling, map.format);
          tile::with_sample_type(GetParam(),
                                 [&]<class T>(T) { compare<T>(map, block.sampling, found, worst[masked], compared); });
          if (HasFatalFailure()) return;
        }
      }
    EXPECT_GT(compared, 50'000);
    // Bytes, in fixed point: fractions are off by 2^-16 at most, 255 * 2^-15 for both axes, shares of levels by 2^-15,
    // and each product, down, across and between levels, by 1/256; where half of the weight is missing all of it counts
    // twice. Others: four steps of float, of texels up to 65535 or, with the overshoot of cubic weights, more.
    const bool fixed = GetParam() == tile::SampleType::UInt8 && interpolation == Interpolation::Bilinear;
    constexpr double places = 2 * 0x1p-20;  // along both axes: these blocks are small
    const double bound = fixed                                     ? 2 * 255 * 0x1p-15 + 3.0 / 256
                         : GetParam() == tile::SampleType::UInt8   ? 1e-4
                         : GetParam() == tile::SampleType::Float32 ? 2e-4 + places * 143
                                                                   : 0.03 + places * 65535;
    EXPECT_LE(worst[0], bound) << "interpolation " << static_cast<int>(interpolation);
    EXPECT_LE(worst[1], 3 * bound) << "interpolation " << static_cast<int>(interpolation);
  }
}

INSTANTIATE_TEST_SUITE_P(Types, Definition,
                         testing::Values(tile::SampleType::UInt8, tile::SampleType::Int16, tile::SampleType::UInt16,
                                         tile::SampleType::Float32),
                         [](const auto& tested) { return std::string(to_string(tested.param)); });

TEST(SampleBlock, ReadsOneLevelOutsideTheBandAndTwoWithin) {
  // Level k holds 10 k
  const auto constant = [](double value) { return [value](int, int, int) { return value; }; };
  const test::LevelInMemory fine(tile::SampleType::UInt8, 1, 256, 256, constant(10)),
      coarse(tile::SampleType::UInt8, 1, 128, 128, constant(20));
  const std::array windows = {fine.window(0, 1), coarse.window(1, 2)};
  BlockSampling block;
  block.width = 64;
  block.height = 1;
  block.texel_from_image.topLeftCorner<2, 2>() *= 1.5;
  block.map_width = block.map_height = 256;
  block.inside = true;
  block.levels = windows;
  block.level_at_corner = {0, 1, 1, 0};
  const auto at = [&](double band, std::size_t x) {
    block.level_blend.band = band;
    return static_cast<int>(test::sample(best_kernels(), block, {tile::SampleType::UInt8, 1}).samples[x]);
  };
  EXPECT_EQ(at(1, 16), 13);  // 16.5 / 64
  EXPECT_EQ(at(0.25, 16), 10);
  EXPECT_EQ(at(0.25, 32), 15);
  EXPECT_EQ(at(0.25, 48), 20);
  EXPECT_EQ(at(0, 31), 10);
  EXPECT_EQ(at(0, 32), 20);
}

/// Waves of all directions, whose amplitude falls with frequency as that of photographs does. Their mean over a square
/// is known.
class Waves {
 public:
  Waves() {
    std::mt19937 random(1);
    for (int i = 0; i < 400; ++i) {
      const auto uniform = [&](double low, double high) { return low + (high - low) * random() * 0x1p-32; };
      const double frequency = std::exp2(uniform(-6, 1)), angle = uniform(0, 6.3);  // a texel
      waves_.push_back({frequency * std::cos(angle), frequency * std::sin(angle), uniform(0, 6.3), 1 / frequency});
    }
  }
  /// Over a square of `side` around a place, texels.
  double mean(double x, double y, double side) const {
    double sum = 0;
    for (const Wave& w : waves_)
      sum += w.amplitude * std::sin(two_pi * (w.x * x + w.y * y) + w.phase) * sinc(w.x * side) * sinc(w.y * side);
    return sum;
  }

 private:
  static constexpr double two_pi = 6.283185307179586;
  struct Wave {
    double x, y, phase, amplitude;
  };
  static double sinc(double t) { return std::abs(t) < 1e-9 ? 1 : std::sin(two_pi / 2 * t) / (two_pi / 2 * t); }
  std::vector<Wave> waves_;
};

TEST(Cubic, IsNearerToTheTruthThanBilinearAtOneToOneAndCloser) {
  const Waves waves;
  const test::LevelInMemory level(tile::SampleType::Float32, 1, 96, 96,
                                  [&](int col, int row, int) { return waves.mean(col + 0.5, row + 0.5, 1); });
  const std::array windows = {level.window()};
  for (const double side : {1.0, 0.25}) {
    BlockSampling block;
    block.width = block.height = 48;
    block.texel_from_image.topLeftCorner<2, 2>() *= side;
    block.texel_from_image(2, 0) = 1e-3;  // all fractions occur
    block.texel_origin = {20.3, 21.7};
    block.map_width = block.map_height = 96;
    block.inside = true;
    block.levels = windows;
    const auto error_of = [&](Interpolation interpolation) {
      block.interpolation = interpolation;
      const auto pixels = test::sample(best_kernels(), block, {tile::SampleType::Float32, 1});
      const auto* samples = reinterpret_cast<const float*>(pixels.samples.data());
      double sum = 0;
      for (int y = 0; y < block.height; ++y)
        for (int x = 0; x < block.width; ++x) {
          const Eigen::Vector2d at = block.texel_origin + apply(block.texel_from_image, {x + 0.5, y + 0.5});
          const double error = samples[y * (block.width + 3) + x] - waves.mean(at.x(), at.y(), side);
          sum += error * error;
        }
      return std::sqrt(sum / (block.width * block.height));
    };
    const double gain_db = 20 * std::log10(error_of(Interpolation::Bilinear) / error_of(Interpolation::Cubic));
    std::printf("%.2f texels a pixel: cubic gains %.2f dB\n", side, gain_db);
    EXPECT_GT(gain_db, 0.5);
  }
}

}  // namespace
}  // namespace nadir::render

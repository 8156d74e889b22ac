#include <gtest/gtest.h>

#include "pyramid/blocks.h"

namespace nadir::pyramid {
namespace {

/// The coarser texel that holds the centre of finer texel j, by its definition; of two that touch there the higher.
std::int32_t parent(std::int32_t fine, std::int32_t coarse, std::int32_t j) {
  return static_cast<std::int32_t>((2 * std::int64_t{j} + 1) * coarse / (2 * std::int64_t{fine}));
}

TEST(Parents, AreTheTexelsThatHoldTheCentres) {
  for (const std::int32_t fine : {1, 2, 3, 4, 5, 17, 18, 101, 4999, 2147483647}) {
    const std::int32_t coarse = fine - fine / 2;
    const Reducer reducer(TexelType{}, {}, {fine, 1}, {coarse, 1});
    for (std::int32_t j = 0; j < fine; j += std::max(1, fine / 5000)) {
      const Window one = reducer.parents({j, 0, 1, 1}), to_end = reducer.parents({j, 0, fine - j, 1});
      ASSERT_EQ(one.x, parent(fine, coarse, j)) << j << " of " << fine;
      ASSERT_EQ(one.width, 1);
      ASSERT_EQ(to_end.x + to_end.width, coarse);
      if (j > fine - std::max(1, fine / 5000)) break;  // j must not overflow
    }
  }
}

/// Root of the mean square of differences, one by one.
template <class T>
long double oracle(const TexelType& type, LevelSize size, const Block& fine, const Window& tile, const Block& coarse,
                   int band) {
  const LevelSize c = half(size);
  const auto counts = [&](const Block& block, std::int32_t x, std::int32_t y) {
    const T sample = sample_at<T>(block, type, x, y, band);
    return (!type.mask || block.valid_row(y)[x - block.window().x] != 0) &&
           (!type.alpha || sample_at<T>(block, type, x, y, type.bands - 1) > T{}) &&
           std::isfinite(static_cast<long double>(sample)) &&
           !(type.nodata && static_cast<double>(sample) == *type.nodata);
  };
  long double sum = 0;
  std::uint64_t count = 0;
  for (std::int32_t y = tile.y; y < tile.y + tile.height; ++y)
    for (std::int32_t x = tile.x; x < tile.x + tile.width; ++x) {
      const std::int32_t px = parent(size.width, c.width, x), py = parent(size.height, c.height, y);
      if (!counts(fine, x, y) || !counts(coarse, px, py)) continue;
      const long double d = static_cast<long double>(sample_at<T>(fine, type, x, y, band)) -
                            static_cast<long double>(sample_at<T>(coarse, type, px, py, band));
      sum += d * d;
      ++count;
    }
  return count == 0 ? 0 : std::sqrt(sum / static_cast<long double>(count));
}

TEST(Loss, IsTheRootOfTheMeanSquareOfDifferencesFromParents) {
  unsigned seed = 0;
  for (const Sample sample : all_samples)
    for (const Holes holes : all_holes)
      for (const LevelSize size : {LevelSize{40, 24}, LevelSize{41, 23}, LevelSize{1, 7}})
        for (const unsigned missing : {0u, 2u, 8u}) {
          const TexelType type = texel_type(sample, 2 + static_cast<int>(seed++ % 3), holes);
          const Block fine = random_block(type, all_of(size), seed, missing);
          const LevelSize c = half(size);
          Block coarse(type, all_of(c));
          const Reducer reducer(type, {}, size, c);
          reducer.reduce(fine, coarse);
          const Window tile{size.width / 3, size.height / 4, size.width - size.width / 3, size.height / 2 + 1};
          std::vector<float> loss(static_cast<std::size_t>(type.data_bands()), -1);
          reducer.loss(fine, tile, coarse, loss);
          for (int b = 0; b < type.data_bands(); ++b)
            tiff::with_sample(sample, [&]<class T>(T) {
              // A float's last bit, and a double's each for a thousand additions.
              const long double expected = oracle<T>(type, size, fine, tile, coarse, b);
              ASSERT_NEAR(loss[static_cast<std::size_t>(b)], expected, expected * 0x1p-23L);
            });
        }
}

TEST(Loss, OfLevelsAddsUpByTheBoxOnEvenSizes) {
  // Differences from a block's mean are orthogonal to what is the same all over it: energies of levels add up, as those
  // of a Haar transform do. In doubles nothing is rounded that would show.
  constexpr std::int32_t side = 64;
  const TexelType type{Sample::F64, 1};
  const Block full = random_block(type, {0, 0, side, side}, 9, 0);
  Block fine = random_block(type, {0, 0, side, side}, 9, 0);
  double energy = 0;
  for (std::int32_t size = side; size > 1; size /= 2) {
    Block coarse(type, {0, 0, size / 2, size / 2});
    const Reducer reducer(type, {}, {size, size}, {size / 2, size / 2});
    reducer.reduce(fine, coarse);
    float loss = 0;
    reducer.loss(fine, fine.window(), coarse, {&loss, 1});
    energy += static_cast<double>(loss) * static_cast<double>(loss);
    fine = std::move(coarse);
    double direct = 0;
    for (std::int32_t y = 0; y < side; ++y)
      for (std::int32_t x = 0; x < side; ++x) {
        const double d = sample_at<double>(full, type, x, y, 0) -
                         sample_at<double>(fine, type, x * size / 2 / side, y * size / 2 / side, 0);
        direct += d * d / (side * side);
      }
    EXPECT_NEAR(energy, direct, direct * 0x1p-22) << "level of " << size / 2;  // losses are floats, squared
  }
}

TEST(Loss, OfManyRowsOfTheGreatestDifferenceDoesNotOverflow) {
  const TexelType type{Sample::U8, 1};
  for (const std::int32_t height : {70001, 70002}) {  // 255^2 * 66051 is the greatest sum of 32 bits
    Block fine(type, {0, 0, 1, height}), coarse(type, {0, 0, 1, height - height / 2});
    std::fill_n(fine.row(0), height, std::byte{255});
    std::fill_n(coarse.row(0), height - height / 2, std::byte{0});
    float loss = 0;
    Reducer(type, {}, {1, height}, {1, height - height / 2}).loss(fine, fine.window(), coarse, {&loss, 1});
    EXPECT_EQ(loss, 255);
  }
}

TEST(Loss, OfExtremesIsFinite) {
  const TexelType type{Sample::F64, 1};
  constexpr double most = std::numeric_limits<double>::max();
  Block fine(type, {0, 0, 2, 1}), coarse(type, {0, 0, 1, 1});
  sample_at<double>(fine, type, 0, 0, 0) = most;
  sample_at<double>(fine, type, 1, 0, 0) = -most;
  const Reducer reducer(type, {}, {2, 1}, {1, 1});
  reducer.reduce(fine, coarse);
  float loss = 0;
  reducer.loss(fine, fine.window(), coarse, {&loss, 1});
  EXPECT_EQ(loss, std::numeric_limits<float>::max());
}

}  // namespace
}  // namespace nadir::pyramid

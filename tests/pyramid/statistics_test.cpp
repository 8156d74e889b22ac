#include "statistics.h"

#include <gtest/gtest.h>

#include "pyramid/blocks.h"

namespace nadir::pyramid {
namespace {

template <class T>
std::vector<long double> valid_samples(const TexelType& type, const Block& block, const Window& w, int band) {
  std::vector<long double> all;
  for (std::int32_t y = w.y; y < w.y + w.height; ++y)
    for (std::int32_t x = w.x; x < w.x + w.width; ++x) {
      const T sample = sample_at<T>(block, type, x, y, band);
      if (type.mask && block.valid_row(y)[x - block.window().x] == 0) continue;
      if (type.alpha && !(sample_at<T>(block, type, x, y, type.bands - 1) > T{})) continue;
      if (!std::isfinite(static_cast<long double>(sample))) continue;
      if (type.nodata && static_cast<double>(sample) == *type.nodata) continue;
      all.push_back(static_cast<long double>(sample));
    }
  return all;
}

void expect_near(const BandStatistics& s, const std::vector<long double>& samples) {
  ASSERT_EQ(s.count, samples.size());
  if (samples.empty()) {
    EXPECT_EQ(s.minimum, 0);
    EXPECT_EQ(s.maximum, 0);
    return;
  }
  long double sum = 0, squares = 0, size = 0;
  for (const long double v : samples) {
    sum += v;
    size = std::max(size, std::abs(v));
  }
  const long double mean = sum / static_cast<long double>(samples.size());
  for (const long double v : samples) squares += (v - mean) * (v - mean);
  EXPECT_EQ(s.minimum, static_cast<double>(*std::min_element(samples.begin(), samples.end())));
  EXPECT_EQ(s.maximum, static_cast<double>(*std::max_element(samples.begin(), samples.end())));
  // A thousand additions in double, each off by 2^-53 of a sum of at most a thousand samples.
  EXPECT_NEAR(s.mean, static_cast<double>(mean), static_cast<double>(size * 0x1p-43L));
  EXPECT_NEAR(s.sum_of_squares, static_cast<double>(squares), static_cast<double>(squares * 0x1p-43L));
}

TEST(Statistics, AreThoseOfWhatIsValid) {
  unsigned seed = 0;
  for (const Sample sample : all_samples)
    for (const Holes holes : all_holes)
      for (const unsigned missing : {0u, 2u, 8u}) {
        const TexelType type = texel_type(sample, 2 + static_cast<int>(seed++ % 3), holes);
        const Block block = random_block(type, {5, 7, 37, 29}, seed, missing);
        const Window window{8, 9, 31, 27};
        const auto all = statistics(type, block, window);
        ASSERT_EQ(all.size(), static_cast<std::size_t>(type.data_bands()));
        for (int b = 0; b < type.data_bands(); ++b)
          tiff::with_sample(sample, [&]<class T>(T) {
            expect_near(all[static_cast<std::size_t>(b)], valid_samples<T>(type, block, window, b));
          });
      }
}

TEST(Statistics, OfPartsAddUpToThoseOfTheWhole) {
  const TexelType type{Sample::F32, 1};
  const Block block = random_block(type, {0, 0, 64, 64}, 4, 1);
  BandStatistics sum;
  for (const std::int32_t y : {0, 20})
    for (const std::int32_t x : {0, 30})
      sum.add(statistics(type, block, {x, y, x == 0 ? 30 : 34, y == 0 ? 20 : 44}).front());
  expect_near(sum, valid_samples<float>(type, block, block.window(), 0));
}

TEST(Statistics, OfIntegersAreExactFarFromZero) {
  // A mean square less the square of the mean would leave nothing of a spread of 1 in doubles.
  const TexelType type{Sample::U16, 1};
  Block block(type, {0, 0, 512, 512});
  for (std::int32_t y = 0; y < 512; ++y)
    for (std::int32_t x = 0; x < 512; ++x)
      sample_at<std::uint16_t>(block, type, x, y, 0) = static_cast<std::uint16_t>(65534 + x % 2);
  const BandStatistics s = statistics(type, block, block.window()).front();
  EXPECT_EQ(s.mean, 65534.5);
  EXPECT_EQ(s.sum_of_squares, 512 * 512 / 4.0);
}

TEST(Statistics, OfManyRowsOfBytesDoNotOverflow) {
  const TexelType type{Sample::U8, 1};
  constexpr std::int32_t height = 70001;  // 255^2 * 66051 is the greatest sum of 32 bits
  Block block(type, {0, 0, 1, height});
  std::fill_n(block.row(0), height, std::byte{255});
  *block.row(height - 1) = std::byte{0};
  const BandStatistics s = statistics(type, block, block.window()).front();
  constexpr double n = height, mean = 255 * (n - 1) / n;
  EXPECT_DOUBLE_EQ(s.mean, mean);
  EXPECT_DOUBLE_EQ(s.sum_of_squares, mean * mean + (255 - mean) * (255 - mean) * (n - 1));
  EXPECT_EQ(s.minimum, 0);
}

TEST(Statistics, OfExtremesAreNumbers) {
  const TexelType type{Sample::F64, 1};
  constexpr double most = std::numeric_limits<double>::max();
  Block block(type, {0, 0, 2, 1});
  sample_at<double>(block, type, 0, 0, 0) = most;
  sample_at<double>(block, type, 1, 0, 0) = most;
  BandStatistics high = statistics(type, block, block.window()).front();
  EXPECT_EQ(high.mean, most);
  EXPECT_EQ(high.sum_of_squares, 0);
  sample_at<double>(block, type, 0, 0, 0) = sample_at<double>(block, type, 1, 0, 0) = -most;
  high.add(statistics(type, block, block.window()).front());
  EXPECT_EQ(high.mean, 0);
  EXPECT_EQ(high.minimum, -most);
  EXPECT_EQ(high.sum_of_squares, most);  // as much as a double can say
}

TEST(Empty, IsWhatHoldsNoDataAtAll) {
  const Window all{0, 0, 20, 10};
  for (const Sample sample : all_samples)
    for (const Holes holes : all_holes) {
      const TexelType type = texel_type(sample, 3, holes);
      Block block(type, all);
      mosaic::clear(type, block);
      EXPECT_EQ(empty(type, block, all), mosaic::tells_holes(type));
      if (!mosaic::tells_holes(type)) continue;
      // One sample in the last corner is data; the window beside it stays empty.
      tiff::with_sample(sample, [&]<class T>(T) {
        for (int b = type.data_bands() - 1; b < type.bands; ++b) sample_at<T>(block, type, 19, 9, b) = T{1};
      });
      if (type.mask) block.valid_row(9)[19] = 255;
      EXPECT_FALSE(empty(type, block, all));
      EXPECT_TRUE(empty(type, block, {0, 0, 19, 10}));
    }
  const TexelType type{Sample::F32, 1, false, false, nan};
  Block block(type, all);
  mosaic::clear(type, block);
  EXPECT_TRUE(empty(type, block, all));
}

}  // namespace
}  // namespace nadir::pyramid

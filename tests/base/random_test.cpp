#include "nadir/base/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace nadir {
namespace {

using Counter = std::array<std::uint32_t, 4>;

TEST(Philox, GivesTheKnownAnswersOfItsAuthors) {
  EXPECT_EQ(philox_4x32_10({0, 0, 0, 0}, {0, 0}), (Counter{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  constexpr std::uint32_t f = 0xffffffff;
  EXPECT_EQ(philox_4x32_10({f, f, f, f}, {f, f}), (Counter{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox_4x32_10({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Counter{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(RandomStream, SeedNameSampleAndChannelEachChangeTheDraw) {
  std::set<Counter> seen;
  int draws = 0;
  for (const std::uint64_t seed : {0ull, 1ull, 1ull << 32})
    for (const char* name : {"", "a", "b", "ab", "ba"})
      for (const std::uint64_t sample : {0ull, 1ull, 1ull << 32})
        for (const std::uint64_t channel : {0ull, 1ull, 1ull << 32}) {
          seen.insert(RandomStream(seed, name).bits(sample, channel));
          ++draws;
        }
  EXPECT_EQ(static_cast<int>(seen.size()), draws);
}

TEST(RandomStream, NormalsAreNormalAndIndependent) {
  // n draws of four: the mean of x has a standard error of 1/sqrt(n), x^2 of sqrt(2/n), x^3 of sqrt(15/n), x^4 of
  // sqrt(96/n), a product of two or of neighbours 1/sqrt(n). Five of them: one test in 2 million would fail by chance,
  // were the seed not fixed.
  constexpr int n = 1 << 17;
  const RandomStream stream(7, "test");
  std::array<double, 4> sum1{}, sum2{}, sum3{}, sum4{}, next{};
  double pairs[4][4]{};
  std::array<double, 4> before{};
  for (int k = 0; k < n; ++k) {
    const auto x = stream.normals(static_cast<std::uint64_t>(k), 3);
    for (std::size_t i = 0; i < 4; ++i) {
      const double x2 = x[i] * x[i];
      sum1[i] += x[i], sum2[i] += x2, sum3[i] += x2 * x[i], sum4[i] += x2 * x2, next[i] += x[i] * before[i];
      for (std::size_t j = 0; j < i; ++j) pairs[i][j] += x[i] * x[j];
    }
    before = x;
  }
  const double s = 5 * std::sqrt(n);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(sum1[i], 0, s);
    EXPECT_NEAR(sum2[i], n, s * std::sqrt(2.0));
    EXPECT_NEAR(sum3[i], 0, s * std::sqrt(15.0));
    EXPECT_NEAR(sum4[i], 3.0 * n, s * std::sqrt(96.0));
    EXPECT_NEAR(next[i], 0, s);
    for (std::size_t j = 0; j < i; ++j) EXPECT_NEAR(pairs[i][j], 0, s);
  }
}

}  // namespace
}  // namespace nadir

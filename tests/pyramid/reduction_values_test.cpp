#include <gtest/gtest.h>

#include <cstring>

#include "halve.h"
#include "pyramid/blocks.h"
#include "row_kernels.h"
#include "vector.h"

namespace nadir::pyramid {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A level whose rows hold `samples`, reduced by `reduction`.
template <class T>
std::vector<T> reduced(const TexelType& type, const Reduction& reduction, LevelSize size, const std::vector<T>& samples,
                       const std::vector<std::uint8_t>& valid = {}) {
  Block fine(type, all_of(size)), coarse(type, all_of(half(size)));
  std::memcpy(fine.row(0), samples.data(), samples.size() * sizeof(T));
  if (type.mask) std::memcpy(fine.valid_row(0), valid.data(), valid.size());
  Reducer(type, reduction, size, half(size)).reduce(fine, coarse);
  std::vector<T> out(coarse.texels() * static_cast<std::size_t>(type.bands));
  std::memcpy(out.data(), coarse.row(0), out.size() * sizeof(T));
  if (type.mask) out.push_back(static_cast<T>(coarse.valid_row(0)[0]));
  return out;
}

template <class T>
void expect_kernels_agree(std::uint32_t seed) {
  std::mt19937 random(seed);
  for (const std::size_t bands : {1u, 2u, 3u, 4u, 5u, 11u})
    for (std::size_t texels = 0; texels < 70; ++texels) {  // every tail, and several full vectors
      std::vector<T> top(2 * texels * bands), bottom(top.size()), fast(texels * bands + 1, T{77}), slow = fast;
      for (auto* row : {&top, &bottom})
        for (T& sample : *row) {
          const std::uint64_t bits = (std::uint64_t{random()} << 32) | random();
          if constexpr (std::is_floating_point_v<T>)
            sample = static_cast<T>(static_cast<double>(static_cast<std::int64_t>(bits)) * 1e-9);
          else
            sample = random() % 4 == 0 ? std::numeric_limits<T>::max() : static_cast<T>(bits);
        }
      halve(top.data(), bottom.data(), fast.data(), texels, bands);
      scalar::halve(top.data(), bottom.data(), slow.data(), texels, bands);
      ASSERT_EQ(fast, slow) << texels << " texels of " << bands << " bands";
      ASSERT_EQ(fast.back(), T{77}) << "written beyond the end";

#if defined(__x86_64__)
      if (!has_avx2() || texels < 2) continue;
      const T* rows[3] = {top.data(), bottom.data(), top.data()};
      const double weights[3] = {3, 34, 31};
      std::vector<double> one(top.size()), other(top.size());
      run_avx2<SumRows<T>>(rows, weights, 3, one.data(), one.size());
      SumRows<T>::run(rows, weights, 3, other.data(), other.size());
      ASSERT_EQ(one, other);
      const auto coarse = static_cast<std::int32_t>(texels);
      const typename MeanOfColumns<T>::Row row{{2 * coarse - 1, coarse}, 0, 0, 68};
      run_avx2<MeanOfColumns<T>>(row, one.data(), fast.data(), texels, bands);
      MeanOfColumns<T>::run(row, one.data(), slow.data(), texels, bands);
      ASSERT_EQ(fast, slow);
      if constexpr (std::is_integral_v<T>) {
        run_avx2<ModeOf4<T>>(top.data(), bottom.data(), fast.data(), texels, bands);
        ModeOf4<T>::run(top.data(), bottom.data(), slow.data(), texels, bands);
        ASSERT_EQ(fast, slow);
      }
#endif
    }
}

TEST(ReductionKernels, GiveTheBitsOfTheirDefinitionAtEveryLength) {
  std::uint32_t seed = 0;
  for (const Sample sample : all_samples)
    tiff::with_sample(sample, [&]<class T>(T) {
      // Means of 64-bit integers on odd sizes are made texel by texel.
      if constexpr (std::is_floating_point_v<T> || sizeof(T) < 8) expect_kernels_agree<T>(++seed);
    });
}

TEST(Reduction, HalvesGoUp) {
  EXPECT_EQ(reduced<std::uint8_t>({Sample::U8, 1}, {}, {2, 2}, {1, 1, 2, 2}), (std::vector<std::uint8_t>{2}));
  EXPECT_EQ(reduced<std::int16_t>({Sample::I16, 1}, {}, {2, 2}, {-1, -1, -2, -2}), (std::vector<std::int16_t>{-1}));
  EXPECT_EQ(reduced<std::int8_t>({Sample::I8, 1}, {}, {1, 2}, {-128, -127}), (std::vector<std::int8_t>{-127}));
}

TEST(Reduction, WholeNumbersOf64BitsAreExact) {
  constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  constexpr std::int64_t top = std::numeric_limits<std::int64_t>::max(),
                         least = std::numeric_limits<std::int64_t>::min();
  EXPECT_EQ(reduced<std::uint64_t>({Sample::U64, 1}, {}, {2, 2}, {most, most, most, most - 4})[0], most - 1);
  EXPECT_EQ(reduced<std::int64_t>({Sample::I64, 1}, {}, {2, 2}, {top, least, top, least})[0], 0);        // -1/2, up
  EXPECT_EQ(reduced<std::uint64_t>({Sample::U64, 1}, {}, {3, 1}, {most, most - 3, most})[0], most - 1);  // areas 2 : 1
  // A nodata of 2^64, which stands for the greatest, has no part in it.
  EXPECT_EQ(reduced<std::uint64_t>({Sample::U64, 1, false, false, 0x1p64}, {}, {2, 1}, {most, 5})[0], 5u);
}

TEST(Reduction, ExtremesOfFloatsStayWhatTheyAre) {
  constexpr double most = std::numeric_limits<double>::max(), tiny = std::numeric_limits<double>::denorm_min();
  constexpr float most_32 = std::numeric_limits<float>::max(), tiny_32 = std::numeric_limits<float>::denorm_min();
  for (const Filter filter : {Filter::Box, Filter::Nearest, Filter::Mode})
    for (const LevelSize size : {LevelSize{2, 2}, LevelSize{1, 4}}) {
      const Reduction reduction{filter};
      EXPECT_EQ(reduced<double>({Sample::F64, 1}, reduction, size, {most, most, most, most})[0], most);
      EXPECT_EQ(reduced<double>({Sample::F64, 1}, reduction, size, {tiny, tiny, tiny, tiny})[0], tiny);
      EXPECT_EQ(reduced<float>({Sample::F32, 1}, reduction, size, {most_32, most_32, most_32, most_32})[0], most_32);
      EXPECT_EQ(reduced<float>({Sample::F32, 1}, reduction, size, {tiny_32, tiny_32, tiny_32, tiny_32})[0], tiny_32);
    }
  EXPECT_EQ(reduced<double>({Sample::F64, 1}, {}, {2, 2}, {most, most, 0, 0})[0], most / 2);
  EXPECT_EQ(reduced<double>({Sample::F64, 1}, {}, {3, 1}, {most, most, most})[1], most);
  // Overshoot of a step between the ends of the type ends with it.
  std::vector<double> step(24);
  for (std::size_t i = 0; i < step.size(); ++i) step[i] = i < 12 ? -most : most;
  for (const double sample : reduced<double>({Sample::F64, 1}, {Filter::Lanczos}, {24, 1}, step))
    EXPECT_LE(std::abs(sample), most);
}

TEST(Reduction, ZeroHasOneSign) {
  const float zero = reduced<float>({Sample::F32, 1}, {}, {2, 2}, {-0.0f, -0.0f, -0.0f, -0.0f})[0];
  EXPECT_EQ(std::signbit(zero), std::signbit(reduced<float>({Sample::F32, 1}, {}, {1, 2}, {-0.0f, -0.0f})[0]));
}

TEST(Reduction, WhatIsNoNumberHasNoPart) {
  const float hole = static_cast<float>(nan), beyond = static_cast<float>(infinity);
  for (const Filter filter : {Filter::Box, Filter::Gaussian, Filter::Lanczos, Filter::Mode})
    EXPECT_EQ(reduced<float>({Sample::F32, 1}, {filter}, {2, 2}, {hole, 3, beyond, -beyond})[0], 3)
        << to_string(filter);
  EXPECT_TRUE(std::isnan(reduced<float>({Sample::F32, 1}, {}, {2, 2}, {hole, beyond, -beyond, hole})[0]));
  EXPECT_EQ(reduced<float>({Sample::F32, 1, false, false, -1.0}, {}, {2, 2}, {hole, beyond, -1, hole})[0], -1);
}

TEST(Reduction, AMeanNeverFallsOntoNodata) {
  EXPECT_EQ(reduced<std::uint8_t>({Sample::U8, 1, false, false, 2.0}, {}, {2, 2}, {1, 3, 1, 3})[0], 3);
  EXPECT_EQ(reduced<std::uint8_t>({Sample::U8, 1, false, false, 0.0}, {}, {2, 2}, {0, 0, 0, 0})[0], 0);
  const float beside = reduced<float>({Sample::F32, 1, false, false, 0.0}, {}, {2, 2}, {-1, 1, -1, 1})[0];
  EXPECT_NE(beside, 0);
  EXPECT_LT(std::abs(beside), 1e-30f);
  // Overshoot beyond a step ends with the type, which is nodata and has room below only.
  const std::vector<std::uint8_t> step = {0, 0, 0, 0, 0, 0, 254, 254, 254, 254, 254, 254};
  const auto greatest = [&](std::optional<double> nodata) {
    const auto out = reduced<std::uint8_t>({Sample::U8, 1, false, false, nodata}, {Filter::Lanczos}, {12, 1}, step);
    return *std::max_element(out.begin(), out.end());
  };
  EXPECT_EQ(greatest(std::nullopt), 255);
  EXPECT_EQ(greatest(255.0), 254);
}

TEST(Reduction, EdgesOfWhatIsTransparentStayBright) {
  // Black lies where nothing is seen: colours keep theirs, alpha says how much of the texel is covered.
  using Bytes = std::vector<std::uint8_t>;
  const TexelType type{Sample::U8, 2, true};
  for (const Filter filter : {Filter::Box, Filter::Gaussian, Filter::Lanczos})
    EXPECT_EQ(reduced<std::uint8_t>(type, {filter}, {2, 2}, {200, 255, 0, 0, 200, 255, 0, 0}), (Bytes{200, 128}));
  EXPECT_EQ(reduced<std::uint8_t>(type, {}, {2, 2}, {100, 255, 200, 85, 0, 0, 0, 0}), (Bytes{125, 85}));
  EXPECT_EQ(reduced<std::uint8_t>(type, {}, {2, 2}, {9, 0, 9, 0, 9, 0, 9, 0}), (Bytes{0, 0}));
}

TEST(Reduction, AMaskedTexelIsValidWhereAnySampleUnderItIs) {
  using Bytes = std::vector<std::uint8_t>;
  const TexelType type{Sample::U8, 1, false, true};
  EXPECT_EQ(reduced<std::uint8_t>(type, {}, {2, 2}, {10, 20, 30, 40}, {0, 0, 255, 0}), (Bytes{30, 255}));
  EXPECT_EQ(reduced<std::uint8_t>(type, {}, {2, 2}, {10, 20, 30, 40}, {0, 0, 0, 0}), (Bytes{0, 0}));
}

TEST(Reduction, DecibelsAreAveragedInPower) {
  // Powers 1, 0.1, 0.1 and 0.01 have the mean 0.3025: -5.19, where floats are 2^-21 apart.
  const Reduction power{Filter::Box, true};
  EXPECT_NEAR(reduced<float>({Sample::F32, 1}, power, {2, 2}, {0, -10, -10, -20})[0], 10 * std::log10(0.3025), 0x1p-22);
  // 10^(30000 / 10) overflows a double and 10^(-9999 / 10) vanishes in one.
  EXPECT_EQ(reduced<float>({Sample::F32, 1}, power, {2, 2}, {30000, 30000, 30000, 30000})[0], 30000);
  EXPECT_EQ(reduced<float>({Sample::F32, 1}, power, {2, 2}, {-9999, -9999, -9999, -9999})[0], -9999);
  const Reduction scaled{Filter::Box, true, {0.01}, {-30}}, falling{Filter::Box, true, {-0.01}, {-30}};
  EXPECT_EQ(reduced<std::int16_t>({Sample::I16, 1}, scaled, {2, 2}, {3000, 2000, 2000, 1000})[0], 2481);
  EXPECT_EQ(reduced<std::int16_t>({Sample::I16, 1}, falling, {2, 2}, {-3000, -2000, -2000, -1000})[0], -2481);
}

TEST(Reduction, OfEqualModesTheLeastWins) {
  EXPECT_EQ(reduced<std::uint8_t>({Sample::U8, 1}, {Filter::Mode}, {2, 2}, {9, 4, 4, 9})[0], 4);
  EXPECT_EQ(reduced<std::uint8_t>({Sample::U8, 1}, {Filter::Mode}, {2, 2}, {9, 4, 3, 2})[0], 2);
  EXPECT_EQ(reduced<std::uint8_t>({Sample::U8, 1}, {Filter::Mode}, {2, 2}, {9, 4, 9, 9})[0], 9);
  EXPECT_EQ(reduced<std::uint8_t>({Sample::U8, 1}, {Filter::Mode}, {3, 1}, {1, 8, 1}),  // areas 2 : 1 and 1 : 2
            (std::vector<std::uint8_t>{1, 1}));
}

TEST(Reduction, RoundingLeansUpwardByAnEighthOfAStepALevelAtMost) {
  // Of four random integers the mean has fractions 0, 1/4, 1/2 and 3/4 alike: halves up err by +1/8 on average. A level
  // of noise whose mean is known shows the sum over all levels.
  constexpr std::int32_t side = 1024;
  const TexelType type{Sample::U8, 1};
  std::mt19937 random(5);
  Block fine(type, {0, 0, side, side});
  double exact = 0;
  for (std::int32_t y = 0; y < side; ++y)
    for (std::int32_t x = 0; x < side; ++x) {
      const auto sample = static_cast<std::uint8_t>(random() % 256);
      fine.row(y)[x] = static_cast<std::byte>(sample);
      exact += sample;
    }
  exact /= static_cast<double>(side) * side;
  for (std::int32_t size = side; size > 1; size /= 2) {
    Block coarse(type, {0, 0, size / 2, size / 2});
    Reducer(type, {}, {size, size}, {size / 2, size / 2}).reduce(fine, coarse);
    fine = std::move(coarse);
  }
  const double bias = static_cast<double>(fine.row(0)[0]) - exact;
  EXPECT_LE(bias, 10 / 8.0 + 0.5);
  EXPECT_GE(bias, -0.5);
}

}  // namespace
}  // namespace nadir::pyramid

// Each instruction set gives the bytes of the definition, over random blocks of all types, bands, interpolations and
// masks: at edges, across seams, with pixels that see no ground, partly off the map.
#include "kernels.h"

#include <gtest/gtest.h>

#include <cstring>

#include "block_geometry.h"
#include "random_blocks.h"

namespace nadir::render {
namespace {

using test::MapInMemory, test::RandomBlock;

constexpr std::array types = {tile::SampleType::UInt8, tile::SampleType::Int16, tile::SampleType::UInt16,
                              tile::SampleType::Float32};
constexpr std::array interpolations = {Interpolation::Nearest, Interpolation::Bilinear, Interpolation::Cubic};

TEST(Kernels, OfEachInstructionSetGiveTheBytesOfTheDefinition) {
  const auto all = all_kernels();
  for (const Kernels* kernels : all) std::printf("%s\n", kernels->name);
  std::int64_t valid = 0, invalid = 0;
  for (const auto type : types)
    for (const int bands : {1, 2, 3, 4, 5, 9})
      for (const bool masked : {false, true}) {
        const bool around = bands % 2 == 0;
        const tile::Domain domain =
            type == tile::SampleType::Float32 && bands == 2 ? tile::Domain::Decibel : tile::Domain::Linear;
        const MapInMemory map({type, bands, domain}, 300, 200, masked, around, static_cast<std::uint32_t>(bands));
        std::mt19937 random(static_cast<unsigned>(bands) + 10 * masked);
        for (const auto interpolation : interpolations)
          for (int i = 0; i < 25; ++i) {
            const RandomBlock block(map, interpolation, random);
            const test::Pixels expected = test::sample(*all[0], block.sampling, map.format);
            for (std::size_t k = 1; k < all.size(); ++k) {
              const test::Pixels found = test::sample(*all[k], block.sampling, map.format);
              ASSERT_TRUE(found == expected)
                  << all[k]->name << " " << to_string(type) << " x" << bands << " masked " << masked
                  << " interpolation " << static_cast<int>(interpolation) << " block " << i;
            }
            for (const auto v : expected.validity) v == 1 ? ++valid : v == 0 ? ++invalid : 0;
          }
      }
  EXPECT_GT(valid, 100'000) << "these blocks see too little of the map";
  EXPECT_GT(invalid, 100'000);
}

/// Places all over a patch, whole ones and those next to whole ones among them.
struct RandomPlaces {
  explicit RandomPlaces(int side, std::uint32_t seed) {
    std::mt19937 random(seed);
    for (int i = 0; i < row_px; ++i) {
      const auto axis = [&] { return std::uniform_real_distribution<double>(1, side - 3)(random); };
      u[i] = i % 5 == 0 ? std::floor(axis()) : axis();
      v[i] = i % 7 == 0 ? std::ceil(axis()) - 0x1p-30 : axis();
    }
    frame.low = 0;
    frame.high_x = frame.high_y = side - 2;
    frame.pitch = side;
  }
  alignas(64) double u[row_px], v[row_px];
  PatchFrame frame;
};

// Fractions are off by 2^-16 at most, which moves a sample by 255 * 2^-16 for each axis; a product is rounded to half
// of 1/128, down, and again across.
constexpr double fixed_bound = 2 * 255 * 0x1p-16 + 2 * 0.5 / 128;

TEST(FixedPoint, OfBytesStaysWithinItsBound) {
  constexpr int side = 40;
  std::vector<std::uint8_t> patch(side * side);
  double worst = 0;
  for (std::uint32_t seed = 0; seed < 2000; ++seed) {
    std::mt19937 random(seed);
    for (auto& texel : patch) texel = random() % 2 ? 255 : static_cast<std::uint8_t>(random() % 256);
    const RandomPlaces places(side, seed);
    Places placed;
    std::int16_t out[row_px + 32];
    best_kernels().place_fixed(places.u, places.v, places.frame, row_px, placed);
    best_kernels().uint8.bilinear1(patch.data(), side, placed, row_px, out);
    for (int i = 0; i < row_px; ++i) {
      const int x = static_cast<int>(places.u[i]), y = static_cast<int>(places.v[i]);
      const double fx = places.u[i] - x, fy = places.v[i] - y;
      const auto at = [&](int dx, int dy) {
        return static_cast<double>(patch[static_cast<std::size_t>((y + dy) * side + x + dx)]);
      };
      const double exact =
          (1 - fy) * ((1 - fx) * at(0, 0) + fx * at(1, 0)) + fy * ((1 - fx) * at(0, 1) + fx * at(1, 1));
      worst = std::max(worst, std::abs(out[i] / 128.0 - exact));
    }
  }
  EXPECT_LE(worst, fixed_bound);
  EXPECT_GE(worst, fixed_bound / 2) << "these samples no longer exercise the bound";
}

TEST(Places, AreHeldWithinThePatchWhateverTheCoordinates) {
  PatchFrame frame;
  frame.low = 1;
  frame.high_x = 20;
  frame.high_y = 30;
  frame.pitch = 50;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const Kernels* kernels : all_kernels()) {
    alignas(64) double u[row_px] = {nan, inf, -inf, 1e300, -1e300, 5, 20, 20.5},
                       v[row_px] = {nan, inf, -inf, 7, nan, 0};
    Places fixed, placed;
    kernels->place_fixed(u, v, frame, 8, fixed);
    kernels->place(u, v, frame, 8, placed);
    const int expected[] = {50 + 1, 30 * 50 + 20, 50 + 1, 7 * 50 + 20, 50 + 1, 50 + 5, 50 + 20, 50 + 20};
    for (int i = 0; i < 8; ++i) {
      EXPECT_EQ(fixed.at[i], expected[i]) << kernels->name << " " << i;
      EXPECT_EQ(placed.at[i], expected[i]) << kernels->name << " " << i;
    }
  }
}

/// Rows at the limits of what single precision takes: long, curved, turning.
struct RandomRow {
  explicit RandomRow(std::mt19937& random) {
    const auto uniform = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    count = std::uniform_int_distribution<int>(1, row_px)(random);
    const double half = (count - 1) / 2.0, reach = half + 0.5;
    middle.half = half;
    middle.texel.x() = uniform(-20, 320);
    middle.texel.y() = uniform(-20, 220);
    middle.turn = random() % 2 ? uniform(-1, 1) * 0.5 / (half + 17) : 0;
    const double most = most_from_middle / 2 / reach, straight = random() % 2 ? 1 : 0.7;
    middle.slope.x() = uniform(-1, 1) * most * straight;
    middle.slope.y() = uniform(-1, 1) * most * straight;
    if (straight < 1) {
      middle.bend.x() = uniform(-1, 1) * most * 0.3 / reach;
      middle.bend.y() = uniform(-1, 1) * most * 0.3 / reach;
    }
    frame.high_x = 298;
    frame.high_y = 198;
    frame.pitch = 300;
  }
  Eigen::Vector2d at(int i) const {
    const double d = i - middle.half, over = 1 / (1 + d * middle.turn);
    return {
        std::clamp(middle.texel.x() + d * (middle.slope.x() + d * middle.bend.x()) * over, frame.low, frame.high_x),
        std::clamp(middle.texel.y() + d * (middle.slope.y() + d * middle.bend.y()) * over, frame.low, frame.high_y)};
  }
  int count;
  RowMiddle middle;
  PatchFrame frame;
};

// Six roundings, each of a value up to `most_from_middle` or of what makes it: 6 * 64 * 2^-24
constexpr double row_bound = 6 * most_from_middle * 0x1p-24;

TEST(PlacesOfARow, AreThoseInDoublePrecisionWithinTheBoundAndAlikeUnderAllInstructionSets) {
  std::mt19937 random(1);
  double worst = 0, worst_fixed = 0;
  for (int row = 0; row < 20'000; ++row) {
    const RandomRow r(random);
    const auto in_patch = patch_row(r.middle, 0, r.frame);
    ASSERT_TRUE(in_patch) << row;
    Places expected, expected_fixed;
    scalar_kernels().place_row(*in_patch, r.frame, r.count, expected);
    scalar_kernels().place_row_fixed(*in_patch, r.frame, r.count, expected_fixed);
    for (int i = 0; i < r.count; ++i) {
      const Eigen::Vector2d exact = r.at(i);
      const auto off = [&](int place, double x, double y) {
        return std::max(std::abs(place % r.frame.pitch + x - exact.x()),
                        std::abs(place / r.frame.pitch + y - exact.y()));
      };
      worst = std::max(worst, off(expected.at[i], expected.x[i], expected.y[i]));
      worst_fixed = std::max(
          worst_fixed, off(expected_fixed.at[i], expected_fixed.x15[i] * 0x1p-15, expected_fixed.y15[i] * 0x1p-15));
    }
    for (const Kernels* kernels : all_kernels()) {
      Places found, found_fixed;
      // From a row before, far outside of this patch
      std::fill_n(found.at, row_px, 1 << 30);
      std::fill_n(found_fixed.at, row_px, 1 << 30);
      kernels->place_row(*in_patch, r.frame, r.count, found);
      kernels->place_row_fixed(*in_patch, r.frame, r.count, found_fixed);
      for (int i = 0; i < r.count; ++i) {
        ASSERT_TRUE(found.at[i] == expected.at[i] && found.x[i] == expected.x[i] && found.y[i] == expected.y[i])
            << kernels->name << " row " << row << " pixel " << i;
        ASSERT_TRUE(found_fixed.at[i] == expected_fixed.at[i] && found_fixed.x15[i] == expected_fixed.x15[i] &&
                    found_fixed.y15[i] == expected_fixed.y15[i])
            << kernels->name << " row " << row << " pixel " << i;
      }
      if (kernels == &scalar_kernels()) continue;
      for (int i = r.count; i < (r.count + 7) / 8 * 8; ++i)  // kernels take whole groups of 8 pixels
        for (const std::int32_t place : {found.at[i], found_fixed.at[i]})
          ASSERT_TRUE(place >= 0 && place < r.frame.pitch * 200) << kernels->name << " row " << row << " pixel " << i;
    }
  }
  EXPECT_LE(worst, row_bound);
  EXPECT_LE(worst_fixed, row_bound + 0x1p-16);
  EXPECT_GE(worst, row_bound / 8) << "these rows no longer exercise the bound";
}

TEST(PlacesOfARow, AreLeftToDoublePrecisionWhereSingleDoesNotDo) {
  PatchFrame frame;
  frame.high_x = frame.high_y = 300;
  const auto taken = [&](const TexelPath& path) {
    return patch_row(middle_of(path, 0.5, row_px), 0, frame).has_value();
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(taken({.t1 = {0.9, 0.9}}));
  EXPECT_FALSE(taken({.t1 = {1.1, 0.9}})) << "spans too much";
  EXPECT_FALSE(taken({.t1 = {1e-3, 0}, .w = {1, -1.0 / 40}})) << "a pole within the row";
  EXPECT_FALSE(taken({.t1 = {1e-3, 0}, .w = {1, -1.0 / 80}})) << "a pole beside the row";
  EXPECT_FALSE(taken({.t0 = {nan, 0}}));
  EXPECT_FALSE(taken({.t0 = {inf, 0}}));
  EXPECT_FALSE(taken({.t1 = {0, nan}}));
  EXPECT_FALSE(taken({.w = {0, 0}}));
  EXPECT_FALSE(taken({.t0 = {0, 1e9}}));
}

}  // namespace
}  // namespace nadir::render

// Each instruction set gives the bytes of the definition, over random blocks of all types, bands, interpolations and
// masks: at edges, across seams, with pixels that see no ground, partly off the map.
#include "kernels.h"

#include <gtest/gtest.h>

#include <cstring>

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

}  // namespace
}  // namespace nadir::render

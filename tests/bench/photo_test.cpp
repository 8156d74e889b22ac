#include "photo.h"

#include <gtest/gtest.h>
#include <libdeflate.h>

#include <algorithm>
#include <vector>

namespace nadir::bench {
namespace {

constexpr std::int64_t side = 512;

std::vector<std::uint8_t> photo(std::uint64_t seed, std::int64_t first, std::int64_t count, std::int64_t width) {
  std::vector<std::uint8_t> texels(static_cast<std::size_t>(count * width * 3));
  photo_rows(seed, first, count, width, texels.data());
  return texels;
}

TEST(Photo, ATexelDependsOnItsPlaceAndTheSeedAlone) {
  const auto whole = photo(1, 0, side, side), part = photo(1, 300, 50, side / 2);
  for (std::int64_t y = 0; y < 50; ++y)
    ASSERT_TRUE(std::equal(part.begin() + y * side / 2 * 3, part.begin() + (y + 1) * side / 2 * 3,
                           whole.begin() + (300 + y) * side * 3))
        << "row " << y;
  EXPECT_NE(whole, photo(2, 0, side, side));
}

TEST(Photo, DeflateMakesItAboutTwoTimesSmaller) {
  // Orthophotos of 0.2 to 1 m with the horizontal predictor: 1.5 to 2.5 times.
  auto texels = photo(1, 0, side, side);
  for (std::int64_t y = 0; y < side; ++y)
    for (std::int64_t i = side * 3 - 1; i >= 3; --i) {
      auto& texel = texels[static_cast<std::size_t>(y * side * 3 + i)];
      texel = static_cast<std::uint8_t>(texel - texels[static_cast<std::size_t>(y * side * 3 + i - 3)]);
    }
  libdeflate_compressor* const library = libdeflate_alloc_compressor(6);
  std::vector<std::uint8_t> out(libdeflate_zlib_compress_bound(library, texels.size()));
  const std::size_t packed = libdeflate_zlib_compress(library, texels.data(), texels.size(), out.data(), out.size());
  libdeflate_free_compressor(library);
  ASSERT_GT(packed, 0U);
  const double ratio = static_cast<double>(texels.size()) / static_cast<double>(packed);
  EXPECT_GT(ratio, 1.5);
  EXPECT_LT(ratio, 2.5);
}

}  // namespace
}  // namespace nadir::bench

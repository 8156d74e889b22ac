#include "rows.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace nadir::tiff {
namespace {

TEST(AccumulateBytes, GivesTheBitsOfScalarAtEveryLengthAndStep) {
  std::mt19937 random(1);
  for (std::size_t step = 1; step <= 6; ++step)
    for (std::size_t bytes = 0; bytes < 200; ++bytes) {
      std::vector<std::uint8_t> row(bytes + 64);
      for (auto& b : row) b = static_cast<std::uint8_t>(random());
      auto expected = row;
      accumulate_bytes(row.data(), bytes, step);
      scalar::accumulate_bytes(expected.data(), bytes, step);
      ASSERT_EQ(row, expected) << "step " << step << ", " << bytes << " bytes, and nothing beyond them";
    }
}

}  // namespace
}  // namespace nadir::tiff

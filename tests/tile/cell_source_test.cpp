#include "nadir/tile/cell_source.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

namespace nadir::tile {
namespace {

using test::SyntheticMap, test::TemporaryFolder;

TEST(CellSource, ACellHasItsNeighboursTexelsAndRepeatsTheEdgeBeyondTheMap) {
  const TemporaryFolder folder;
  SyntheticMap synthetic;
  synthetic.width = 300;
  synthetic.height = 130;
  synthetic.geotransform = {10, 0.001, 0, 50, 0, -0.001};
  synthetic.value = [](int, int, int col, int row) { return 1000 * row + col; };
  test::write_map(synthetic, folder.file("m.tif"));
  const auto source = CellSource::make(Map::open(folder.file("m.tif")).value(), {}, Domain::Linear).value();
  for (const auto& [col, row] : {std::pair(0, 0), {1, 0}, {2, 1}}) {
    const CellPtr cell = source->load(0, col, row).value();
    ASSERT_TRUE(cell->all_valid);
    for (int y = 0; y < cell_stride; ++y)
      for (int x = 0; x < cell_stride; ++x) {
        const int texel_x = std::clamp(col * cell_size + x - cell_apron, 0, 299),
                  texel_y = std::clamp(row * cell_size + y - cell_apron, 0, 129);
        ASSERT_EQ(cell->data<float>()[y * cell_stride + x], static_cast<float>(1000 * texel_y + texel_x))
            << col << " " << row << " " << x << " " << y;
      }
  }
}

TEST(CellSource, DecibelsAreHeldAsPower) {
  const TemporaryFolder folder;
  SyntheticMap synthetic;
  synthetic.geotransform = {10, 0.001, 0, 50, 0, -0.001};
  synthetic.value = [](int, int, int col, int) { return col == 3 ? std::nan("") : -10.0 * col; };
  test::write_map(synthetic, folder.file("m.tif"));
  const auto source = CellSource::make(Map::open(folder.file("m.tif")).value(), {1}, Domain::Decibel).value();
  const CellPtr cell = source->load(0, 0, 0).value();
  const float* row = cell->data<float>() + cell_apron * cell_stride + cell_apron;
  EXPECT_FLOAT_EQ(row[0], 1.0f);
  EXPECT_FLOAT_EQ(row[2], 0.01f);
  EXPECT_EQ(cell->validity[static_cast<std::size_t>(cell_apron * cell_stride + cell_apron + 3)], 0);
  EXPECT_TRUE(std::isfinite(row[3])) << "an invalid texel must not spread through a product with zero";
}

TEST(CellSource, RefusesBandsThatAreNotThereOrTwice) {
  const TemporaryFolder folder;
  SyntheticMap synthetic;
  synthetic.geotransform = {10, 0.001, 0, 50, 0, -0.001};
  synthetic.value = [](int, int, int, int) { return 0; };
  test::write_map(synthetic, folder.file("m.tif"));
  const Map map = Map::open(folder.file("m.tif")).value();
  EXPECT_EQ(CellSource::make(map, {2}, Domain::Linear).error().kind, Error::Kind::NotFound);
  EXPECT_EQ(CellSource::make(map, {1, 1}, Domain::Linear).error().kind, Error::Kind::Malformed);
}

}  // namespace
}  // namespace nadir::tile

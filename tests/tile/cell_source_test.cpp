#include "nadir/tile/cell_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

namespace nadir::tile {
namespace {

using test::SyntheticMap, test::TemporaryFolder;

/// A map whose texels say where they are, some of them invalid.
SyntheticMap numbered(int width, int height, int tile) {
  SyntheticMap map;
  map.width = width;
  map.height = height;
  map.tile = tile;
  map.bands = 2;
  map.nodata = -1;
  map.geotransform = {10, 0.0001, 0, 50, 0, -0.0001};
  map.value = [](int, int band, int col, int row) {
    return (col * 7 + row * 13) % 31 == 0 ? -1 : 10000 * row + col + 0.25 * band;
  };
  return map;
}

struct Sizes {
  int width, height, tile;
};
class EveryCell : public testing::TestWithParam<Sizes> {};

TEST_P(EveryCell, HoldsTheMapsTexels) {
  const TemporaryFolder folder;
  const auto [width, height, tile] = GetParam();
  const SyntheticMap synthetic = numbered(width, height, tile);
  test::write_map(synthetic, folder.file("m.tif"));
  const auto source = CellSource::make(Map::open(folder.file("m.tif")).value(), {}, Domain::Linear).value();

  // All cells, block by block
  const int cols = (width + cell_size - 1) / cell_size, rows = (height + cell_size - 1) / cell_size;
  std::map<std::pair<int, int>, CellPtr> cells;
  for (int row = 0; row < rows; ++row)
    for (int col = 0; col < cols; ++col) {
      if (cells.contains({col, row})) continue;
      const CellBlock block = source->block_of(0, col, row);
      const auto loaded = source->load(block).value();
      ASSERT_EQ(loaded.size(), block.size());
      for (int r = 0; r < block.rows; ++r)
        for (int c = 0; c < block.cols; ++c)
          cells[{block.col + c, block.row + r}] = loaded[block.index(block.col + c, block.row + r)];
    }
  ASSERT_EQ(cells.size(), static_cast<std::size_t>(cols * rows));
  for (const auto& [place, cell] : cells)
    for (int y = 0; y < std::min(cell_size, height - place.second * cell_size); ++y)
      for (int x = 0; x < std::min(cell_size, width - place.first * cell_size); ++x) {
        const int col = place.first * cell_size + x, row = place.second * cell_size + y;
        const std::size_t at = static_cast<std::size_t>(y) * cell_size + static_cast<std::size_t>(x);
        const bool valid = synthetic.value(0, 0, col, row) != -1;
        ASSERT_EQ(!cell->masked() || cell->validity()[at], valid)
            << place.first << " " << place.second << ": " << x << " " << y;
        for (int b = 0; b < 2; ++b)
          ASSERT_EQ(cell->data<float>()[2 * at + static_cast<std::size_t>(b)],
                    valid ? static_cast<float>(synthetic.value(0, b, col, row)) : 0.0f)
              << place.first << " " << place.second << ": " << x << " " << y << " band " << b;
      }
}

// Tiles of four by four cells, of one, of a part of one; tiles that cells cut, which GDAL reads; edges on a cell's last
// texel, its first, and within
INSTANTIATE_TEST_SUITE_P(CellSource, EveryCell,
                         testing::Values(Sizes{1100, 700, 512}, Sizes{512, 512, 256}, Sizes{385, 257, 128},
                                         Sizes{300, 130, 64}, Sizes{383, 256, 16}, Sizes{500, 300, 240},
                                         Sizes{1, 1, 128}, Sizes{129, 1, 256}));

TEST(CellSource, LoadsOnlyTheCellsThatAreWanted) {
  const TemporaryFolder folder;
  test::write_map(numbered(512, 256, 256), folder.file("m.tif"));
  const auto source = CellSource::make(Map::open(folder.file("m.tif")).value(), {}, Domain::Linear).value();
  const CellBlock block = source->block_of(0, 3, 1);
  EXPECT_EQ(block.col, 2);
  EXPECT_EQ(block.row, 0);
  ASSERT_EQ(block.size(), 4u);
  const std::vector<std::uint8_t> wanted = {0, 0, 0, 1};
  const auto cells = source->load(block, wanted).value();
  EXPECT_FALSE(cells[0] || cells[1] || cells[2]);
  ASSERT_TRUE(cells[3]);
  EXPECT_EQ(cells[3]->data<float>()[0], static_cast<float>(10000 * 128 + 384));
}

TEST(CellSource, ADamagedBlockCanBeStoodForByInvalidCells) {
  const TemporaryFolder folder;
  test::write_map(numbered(512, 256, 256), folder.file("m.tif"));
  const auto source = CellSource::make(Map::open(folder.file("m.tif")).value(), {}, Domain::Linear).value();
  const auto broken = source->damaged(source->block_of(0, 0, 0), {}, "m.tif: a tile is torn");
  for (const auto& cell : broken) {
    EXPECT_EQ(cell->damage(), "m.tif: a tile is torn");
    ASSERT_TRUE(cell->masked());
    EXPECT_EQ(std::count(cell->validity(), cell->validity() + cell_area, 0), static_cast<std::ptrdiff_t>(cell_area));
  }
}

TEST(CellSource, DecibelsAreHeldAsPower) {
  const TemporaryFolder folder;
  SyntheticMap synthetic;
  synthetic.geotransform = {10, 0.001, 0, 50, 0, -0.001};
  synthetic.value = [](int, int, int col, int) { return col == 3 ? std::nan("") : -10.0 * col; };
  test::write_map(synthetic, folder.file("m.tif"));
  const auto source = CellSource::make(Map::open(folder.file("m.tif")).value(), {1}, Domain::Decibel).value();
  const CellPtr cell = source->load(source->block_of(0, 0, 0)).value().front();
  const float* row = cell->data<float>();
  EXPECT_FLOAT_EQ(row[0], 1.0f);
  EXPECT_FLOAT_EQ(row[2], 0.01f);
  EXPECT_EQ(cell->validity()[3], 0);
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

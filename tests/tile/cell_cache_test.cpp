#include "nadir/tile/cell_cache.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

namespace nadir::tile {
namespace {

/// A map of 8 x 8 cells of one float band.
class CellCacheTest : public testing::Test {
 protected:
  CellCacheTest() {
    test::SyntheticMap synthetic;
    synthetic.width = synthetic.height = 8 * cell_size;
    synthetic.geotransform = {10, 0.001, 0, 50, 0, -0.001};
    synthetic.value = [](int, int, int col, int row) { return row / cell_size * 8 + col / cell_size; };
    test::write_map(synthetic, folder.file("m.tif"));
    source = CellSource::make(Map::open(folder.file("m.tif")).value(), {}, Domain::Linear).value();
  }
  static float value(const CellPtr& cell) { return cell->data<float>()[cell_size / 2 * cell_stride + cell_size / 2]; }

  test::TemporaryFolder folder;
  std::shared_ptr<const CellSource> source;
};

TEST_F(CellCacheTest, NeverHoldsMoreThanItsBudget) {
  CellCache cache(5 * source->cell_bytes());
  for (int turn = 0; turn < 3; ++turn)
    for (int i = 0; i < 64; ++i) EXPECT_EQ(value(cache.get(*source, 0, i % 8, i / 8).value()), static_cast<float>(i));
  EXPECT_EQ(cache.counters().peak_bytes, 5 * source->cell_bytes());
  EXPECT_EQ(cache.counters().loads, 3 * 64) << "in turns through more than it holds, the oldest is never there";
}

TEST_F(CellCacheTest, KeepsWhatIsPinnedAndSaysWhenNothingElseIsLeft) {
  CellCache cache(3 * source->cell_bytes());
  std::vector<CellPtr> pinned = {cache.get(*source, 0, 0, 0).value(), cache.get(*source, 0, 1, 0).value(),
                                 cache.get(*source, 0, 2, 0).value()};
  const auto fourth = cache.get(*source, 0, 3, 0);
  ASSERT_FALSE(fourth);
  EXPECT_EQ(fourth.error().kind, Error::Kind::OverBudget);
  pinned.erase(pinned.begin() + 1);
  EXPECT_TRUE(cache.get(*source, 0, 3, 0));
  EXPECT_EQ(cache.counters().evictions, 1);
  EXPECT_EQ(value(cache.get(*source, 0, 0, 0).value()), 0.0f);
  EXPECT_EQ(cache.counters().loads, 4) << "the pinned one was still there";
}

TEST_F(CellCacheTest, LoadsACellOnceHoweverManyThreadsAsk) {
  CellCache cache(64 * source->cell_bytes());
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (int t = 0; t < 8; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 64; ++i) wrong += value(cache.get(*source, 0, i % 8, i / 8).value()) != static_cast<float>(i);
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(cache.counters().loads, 64);
  EXPECT_EQ(source->map().counters().windows_read, 64);
}

TEST_F(CellCacheTest, AFailedLoadIsToldAndNotKept) {
  CellCache cache(64 * source->cell_bytes());
  ASSERT_TRUE(cache.get(*source, 0, 0, 0));
  // The file loses its last tiles while it is open.
  std::filesystem::resize_file(folder.file("m.tif"), std::filesystem::file_size(folder.file("m.tif")) -
                                                         5 * cell_size * cell_size * sizeof(float));
  int read = 0, lost = 0;
  for (int i = 0; i < 64; ++i) {
    const auto cell = cache.get(*source, 0, i % 8, i / 8);
    (cell ? read : lost) += 1;
    if (cell) continue;
    EXPECT_EQ(cell.error().kind, Error::Kind::Io);
    EXPECT_NE(cell.error().message.find("m.tif"), std::string::npos) << cell.error().message;
  }
  EXPECT_GT(lost, 0);
  EXPECT_GT(read, 30) << "the rest stays usable";
  EXPECT_EQ(cache.counters().bytes, read * source->cell_bytes());
}

}  // namespace
}  // namespace nadir::tile

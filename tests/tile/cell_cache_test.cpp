#include "nadir/tile/cell_cache.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

namespace nadir::tile {
namespace {

/// A map of 16 x 16 cells of one float band, in tiles of 2 x 2 cells.
class CellCacheTest : public testing::Test {
 protected:
  CellCacheTest() {
    test::SyntheticMap synthetic;
    synthetic.width = synthetic.height = 16 * cell_size;
    synthetic.tile = 2 * cell_size;
    synthetic.geotransform = {10, 0.0001, 0, 50, 0, -0.0001};
    synthetic.value = [](int, int, int col, int row) { return row / cell_size * 16 + col / cell_size; };
    test::write_map(synthetic, folder.file("m.tif"));
    source = CellSource::make(Map::open(folder.file("m.tif")).value(), {}, Domain::Linear).value();
  }
  static float value(const CellPtr& cell) { return cell->data<float>()[cell_size / 2 * cell_size + cell_size / 2]; }
  CellRequest cell(int i) const { return {source.get(), 0, i % 16, i / 16}; }
  /// Cells of block `i` of 64.
  std::vector<CellRequest> block(int i) const {
    std::vector<CellRequest> cells;
    for (int k = 0; k < 4; ++k) cells.push_back({source.get(), 0, i % 8 * 2 + k % 2, i / 8 * 2 + k / 2});
    return cells;
  }
  std::uint64_t cells(int count) const { return static_cast<std::uint64_t>(count) * source->cell_bytes(); }

  test::TemporaryFolder folder;
  std::shared_ptr<const CellSource> source;
};

TEST_F(CellCacheTest, NeverHoldsMoreThanItsBudget) {
  CellCache cache(cells(10));
  for (int turn = 0; turn < 2; ++turn)
    for (int i = 0; i < 256; ++i)
      EXPECT_EQ(value(cache.get(*source, 0, i % 16, i / 16).value()), static_cast<float>(i));
  const CacheCounters counters = cache.counters();
  EXPECT_LE(counters.peak_bytes, cells(10));
  EXPECT_GE(counters.peak_bytes, cells(8)) << "two blocks fit";
  EXPECT_GT(counters.evictions, 2 * 256 - 10);
}

TEST_F(CellCacheTest, KeepsTheWholeBlockWhereItHasRoomAndElseWhatWasAskedFor) {
  CellCache roomy(cells(4)), tight(cells(3));
  ASSERT_TRUE(roomy.get(*source, 0, 0, 0));
  ASSERT_TRUE(roomy.get(*source, 0, 1, 1));
  EXPECT_EQ(roomy.counters().blocks_loaded, 1);
  EXPECT_EQ(roomy.counters().bytes, cells(4));
  const CellPtr first = tight.get(*source, 0, 0, 0).value(), second = tight.get(*source, 0, 1, 1).value();
  EXPECT_EQ(value(first), 0.0f);
  EXPECT_EQ(value(second), 17.0f);
  EXPECT_EQ(tight.counters().blocks_loaded, 2);
  EXPECT_EQ(tight.counters().bytes, cells(2));
}

TEST_F(CellCacheTest, KeepsWhatIsPinnedAndSaysWhenNothingElseIsLeft) {
  CellCache cache(cells(3));
  std::vector<CellPtr> pinned = {cache.get(*source, 0, 0, 0).value(), cache.get(*source, 0, 2, 0).value(),
                                 cache.get(*source, 0, 4, 0).value()};
  const auto fourth = cache.get(*source, 0, 6, 0);
  ASSERT_FALSE(fourth);
  EXPECT_EQ(fourth.error().kind, Error::Kind::OverBudget);
  const std::array<CellRequest, 2> two = {cell(6), cell(8)};
  EXPECT_EQ(cache.pin(two).error().kind, Error::Kind::OverBudget);
  EXPECT_EQ(cache.counters().bytes, cells(3)) << "what did not fit left nothing";
  pinned.erase(pinned.begin() + 1);
  EXPECT_TRUE(cache.get(*source, 0, 6, 0));
  EXPECT_EQ(cache.counters().evictions, 1);
  EXPECT_EQ(value(cache.get(*source, 0, 0, 0).value()), 0.0f);
  EXPECT_EQ(cache.counters().loads, 4) << "the pinned one was still there";
}

TEST_F(CellCacheTest, PinsManyInTheirOrder) {
  CellCache cache(cells(256));
  std::vector<CellRequest> requests;
  for (int i = 255; i >= 0; i -= 3) requests.push_back(cell(i));
  const auto pinned = cache.pin(requests).value();
  for (std::size_t i = 0; i < pinned.size(); ++i) EXPECT_EQ(value(pinned[i]), 255.0f - 3.0f * static_cast<float>(i));
  EXPECT_EQ(cache.counters().blocks_loaded, 64);
}

TEST_F(CellCacheTest, LoadsABlockOnceHoweverManyThreadsAsk) {
  CellCache cache(cells(256));
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (int t = 0; t < 8; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < 256; ++i) {
        const int k = t % 2 ? i : 255 - i;
        wrong += value(cache.get(*source, 0, k % 16, k / 16).value()) != static_cast<float>(k);
      }
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(cache.counters().blocks_loaded, 64);
  EXPECT_EQ(source->map().counters().windows_read, 64);
}

TEST_F(CellCacheTest, WhatIsWantedFitsThoughWholeBlocksAndWhatComesAheadDoNot) {
  std::vector<CellRequest> wanted, coming;
  for (int i = 0; i < 6; ++i) wanted.push_back(block(7 * i)[0]);
  for (int i = 0; i < 20; ++i) coming.push_back(block(2 * i + 1)[0]);
  for (int round = 0; round < 50; ++round) {
    CellCache cache(cells(8), 4);
    const auto ticket = cache.prefetch(coming);
    const auto pinned = cache.pin(wanted);
    ASSERT_TRUE(pinned) << "round " << round << ": " << pinned.error().message;
    for (std::size_t i = 0; i < wanted.size(); ++i)
      ASSERT_EQ(value((*pinned)[i]), static_cast<float>(wanted[i].row * 16 + wanted[i].col));
    EXPECT_LE(cache.counters().peak_bytes, cells(8));
  }
}

TEST_F(CellCacheTest, ManyThreadsNeverOverrunTheBudget) {
  CellCache cache(cells(40));
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0}, pinned{0};
  for (unsigned t = 0; t < 6; ++t)
    threads.emplace_back([&, t] {
      std::mt19937 random(t);
      for (int round = 0; round < 150; ++round) {
        std::vector<CellRequest> requests;
        std::vector<int> which;
        for (int n = 0; n < 6; ++n)
          which.push_back(static_cast<int>(random() % 256)), requests.push_back(cell(which.back()));
        const auto ticket = cache.prefetch(block(static_cast<int>(random() % 64)));
        const auto got = cache.pin(requests);
        if (!got) continue;  // others hold too much
        ++pinned;
        for (std::size_t i = 0; i < got->size(); ++i) wrong += value((*got)[i]) != static_cast<float>(which[i]);
      }
    });
  for (auto& thread : threads) thread.join();
  cache.wait_for_prefetch();
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(pinned, 300);
  EXPECT_LE(cache.counters().peak_bytes, cells(40));
  // With nothing held, all of it can be had again
  std::vector<CellRequest> all;
  for (int i = 0; i < 10; ++i)
    for (const CellRequest& r : block(6 * i)) all.push_back(r);
  EXPECT_TRUE(cache.pin(all)) << "bytes that nobody holds were lost count of";
}

TEST_F(CellCacheTest, AWorkingSetSurvivesAScan) {
  // 12 blocks that are used again and again, beside a flight over all the others, three times the budget
  CellCache cache(cells(4 * 20));
  const auto visit = [&](int i) { ASSERT_TRUE(cache.pin(block(i))); };
  for (int turn = 0; turn < 2; ++turn)
    for (int i = 0; i < 12; ++i) visit(i);
  const auto before = cache.counters().blocks_loaded;
  for (int i = 12; i < 64; ++i) visit(i);
  EXPECT_EQ(cache.counters().blocks_loaded - before, 52);
  for (int i = 0; i < 12; ++i) visit(i);
  EXPECT_LE(cache.counters().blocks_loaded - before, 52 + 3) << "a cache that keeps what came last reloads all 12";
}

TEST_F(CellCacheTest, WhatIsHeldIsTakenWithoutReading) {
  CellCache cache(cells(3));  // less than a block: the cells asked for alone
  ASSERT_TRUE(cache.get(*source, 0, 1, 0));
  const auto held = cache.held(block(0));
  ASSERT_EQ(held.size(), 4u);
  EXPECT_EQ(value(held[1]), 1);
  EXPECT_TRUE(!held[0] && !held[2] && !held[3]);
  EXPECT_EQ(cache.held(block(1)), std::vector<CellPtr>(4));
  EXPECT_EQ(cache.counters().loads, 1);
  EXPECT_EQ(cache.counters().hits, 1);
}

TEST_F(CellCacheTest, PrefetchCompletesABlockOfWhichOnlyAPartIsHeld) {
  CellCache cache(cells(5));
  auto pinned = cache.pin(std::vector{block(5)[0], block(5)[1]}).value();
  ASSERT_TRUE(cache.pin(std::vector{block(7)[2]})) << "room for a cell, not for a block";
  ASSERT_FALSE(cache.held(block(7))[0]);
  pinned.clear();
  const auto ticket = cache.prefetch(block(7));
  cache.wait_for_prefetch();
  const auto after = cache.held(block(7));
  EXPECT_EQ(std::count(after.begin(), after.end(), nullptr), 0);
}

TEST_F(CellCacheTest, PrefetchesByPriorityAndWhatIsFetchedIsThere) {
  CellCache cache(cells(256));
  const auto ticket = cache.prefetch(block(3));
  const auto urgent = cache.prefetch(block(40), 5);
  cache.wait_for_prefetch();
  EXPECT_EQ(cache.counters().prefetched, 2);
  EXPECT_EQ(value(cache.pin(block(40)).value()[0]), static_cast<float>(40 / 8 * 2 * 16));
  EXPECT_EQ(cache.counters().blocks_loaded, 2);
  EXPECT_EQ(cache.counters().hits, 4);
}

TEST_F(CellCacheTest, PrefetchDisplacesNothingThatIsUsedAgainAndCanBeCancelled) {
  CellCache cache(cells(4 * 4));
  for (int turn = 0; turn < 2; ++turn)
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(cache.pin(block(i)));
  std::vector<CellRequest> many;
  for (int i = 10; i < 40; ++i)
    for (const CellRequest& r : block(i)) many.push_back(r);
  auto ticket = cache.prefetch(many);
  ticket.cancel();
  cache.wait_for_prefetch();
  const CacheCounters counters = cache.counters();
  EXPECT_GT(counters.prefetch_cancelled, 0);
  EXPECT_LE(counters.prefetched + counters.prefetch_cancelled, 30);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(cache.pin(block(i)));
  EXPECT_EQ(cache.counters().blocks_loaded - counters.blocks_loaded, 0);
}

TEST_F(CellCacheTest, AFailedLoadIsToldAndNotKept) {
  CellCache cache(cells(256));
  ASSERT_TRUE(cache.get(*source, 0, 0, 0));
  // The file loses its last tiles while it is open, and nobody wrote to it.
  const auto written = std::filesystem::last_write_time(folder.file("m.tif"));
  std::filesystem::resize_file(folder.file("m.tif"), std::filesystem::file_size(folder.file("m.tif")) -
                                                         20 * cell_size * cell_size * sizeof(float));
  std::filesystem::last_write_time(folder.file("m.tif"), written);
  int read = 0, lost = 0;
  for (int i = 0; i < 64; ++i) {
    const auto got = cache.pin(block(i));
    (got ? read : lost) += 1;
    if (got) continue;
    EXPECT_EQ(got.error().kind, Error::Kind::Io);
    EXPECT_NE(got.error().message.find("m.tif"), std::string::npos) << got.error().message;
  }
  EXPECT_GT(lost, 3);
  EXPECT_GT(read, 50) << "the rest stays usable";
  EXPECT_EQ(cache.counters().bytes, cells(4 * read));
}

TEST_F(CellCacheTest, ADamagedTileIsThereAsInvalidCellsThatSayWhyAndIsTriedOnce) {
  // The table of tiles sends the last one beyond the file's end
  std::size_t offset = 0;
  {
    const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(folder.file("m.tif").c_str()));
    offset = std::stoul(dataset->GetRasterBand(1)->GetMetadataItem("BLOCK_OFFSET_7_7", "TIFF"));
  }
  std::string bytes = test::bytes_of(folder.file("m.tif"));
  std::string place(4, '\0');
  for (int i = 0; i < 4; ++i) place[static_cast<std::size_t>(i)] = static_cast<char>(offset >> (8 * i));
  const std::size_t entry = bytes.find(place);
  ASSERT_NE(entry, std::string::npos);
  bytes.replace(entry, 4, "\xff\xff\xff\x7f");
  std::ofstream(folder.file("torn.tif"), std::ios::binary) << bytes;
  const auto torn = CellSource::make(Map::open(folder.file("torn.tif")).value(), {}, Domain::Linear).value();
  EXPECT_EQ(torn->load(torn->block_of(0, 15, 15)).error().kind, Error::Kind::Damaged);

  CellCache cache(cells(256));
  for (int turn = 0; turn < 2; ++turn) {
    const CellPtr cell = cache.get(*torn, 0, 15, 15).value();
    EXPECT_NE(cell->damage().find("torn.tif: level 0, tile (7, 7)"), std::string::npos) << cell->damage();
    ASSERT_TRUE(cell->masked());
    EXPECT_EQ(std::count(cell->validity(), cell->validity() + cell_area, 1), 0);
  }
  EXPECT_EQ(cache.counters().blocks_loaded, 1);
  EXPECT_EQ(cache.get(*torn, 0, 13, 15).value()->damage(), "");
}

}  // namespace
}  // namespace nadir::tile

#include "levels.h"

#include <gtest/gtest.h>

#include <map>

namespace nadir::pyramid {
namespace {

TEST(Levels, EachIsHalfOfTheOneBeforeRoundedUp) {
  const auto sizes = level_sizes(2051, 70);
  const std::vector<std::pair<int, int>> expected = {{2051, 70}, {1026, 35}, {513, 18}, {257, 9},
                                                     {129, 5},   {65, 3},    {33, 2}};
  ASSERT_EQ(sizes.size(), expected.size());
  for (std::size_t k = 0; k < sizes.size(); ++k)
    EXPECT_EQ(std::pair(sizes[k].width, sizes[k].height), expected[k]) << k;
}

TEST(LevelPlan, EveryTileOfEveryLevelIsPackedByOneChunk) {
  for (const LevelSize size : {LevelSize{1, 1}, LevelSize{4096, 4096}, LevelSize{5001, 129}, LevelSize{130, 9000}}) {
    for (const int depth : {1, 2, 3}) {
      const LevelPlan plan(size, 128, depth);
      std::map<std::tuple<int, int, int>, int> packed;
      for (const Stage& stage : plan.stages()) {
        const TileRange chunks = plan.chunks(stage);
        for (int row = 0; row < chunks.rows; ++row)
          for (int col = 0; col < chunks.cols; ++col)
            for (int level = stage.first; level < stage.first + stage.levels; ++level) {
              const TileRange tiles = plan.tiles_of(stage, {col, row}, level);
              EXPECT_GT(tiles.count(), 0);
              for (int y = 0; y < tiles.rows; ++y)
                for (int x = 0; x < tiles.cols; ++x) ++packed[{level, tiles.row + y, tiles.col + x}];
            }
      }
      std::int64_t tiles = 0;
      for (std::size_t level = 0; level < plan.sizes().size(); ++level)
        tiles += plan.tiles(static_cast<int>(level)).count();
      EXPECT_EQ(static_cast<std::int64_t>(packed.size()), tiles);
      for (const auto& [tile, times] : packed) EXPECT_EQ(times, 1);
    }
  }
}

TEST(LevelPlan, AStageHandsOnOneTileForEachOfItsChunks) {
  const LevelPlan plan({10000, 7000}, 128, 2);
  for (const Stage& stage : plan.stages()) {
    if (!stage.hands_on) continue;
    const TileRange chunks = plan.chunks(stage), tiles = plan.tiles(stage.first + stage.levels);
    EXPECT_EQ(chunks.cols, tiles.cols);
    EXPECT_EQ(chunks.rows, tiles.rows);
    EXPECT_EQ(plan.tiles_of(stage, {1, 0}, stage.first + stage.levels).col, 1);
  }
}

}  // namespace
}  // namespace nadir::pyramid

#include "block_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <thread>

#include "mosaic/raster_file.h"
#include "nadir/mosaic/source.h"
#include "support/temporary_folder.h"

namespace nadir::mosaic {
namespace {

using test::TemporaryFolder;

const TexelType bytes_type{Sample::U8, 1, false, false, std::nullopt};

TEST(BlockCache, DecodesABlockOnceForAllWhoAskMeanwhile) {
  BlockCache cache(1 << 20);
  std::atomic<int> decoded{0}, arrived{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t)
    threads.emplace_back([&] {
      ++arrived;
      const auto block = cache.get(0, 7, [&](Block& fresh) -> Result<void> {
        while (arrived < 8) std::this_thread::yield();
        ++decoded;
        fresh.reset(bytes_type, {0, 0, 4, 4});
        *fresh.row(0) = std::byte{42};
        return {};
      });
      EXPECT_EQ(*(*block)->row(0), std::byte{42});
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(decoded, 1);
}

TEST(BlockCache, DropsWhatWasUsedLongestAgoAndHoldsNoMoreThanItsLimit) {
  BlockCache cache(3 * 16);
  int decoded = 0;
  const auto get = [&](std::uint64_t index) {
    const auto block = cache.get(0, index, [&](Block& fresh) -> Result<void> {
      ++decoded;
      fresh.reset(bytes_type, {0, 0, 4, 4});
      *fresh.row(0) = static_cast<std::byte>(index);
      return {};
    });
    EXPECT_EQ(*(*block)->row(0), static_cast<std::byte>(index));
  };
  for (const std::uint64_t index : {1, 2, 3, 1}) get(index);
  EXPECT_EQ(decoded, 3);
  get(4);  // 2 goes
  get(1);
  get(3);
  EXPECT_EQ(decoded, 4);
  get(2);
  EXPECT_EQ(decoded, 5);
}

TEST(BlockCache, LeavesABlockToThoseWhoHoldItWhenItIsDropped) {
  BlockCache cache(16);
  const auto get = [&](std::uint64_t index) {
    return *cache.get(0, index, [&](Block& fresh) -> Result<void> {
      fresh.reset(bytes_type, {0, 0, 4, 4});
      *fresh.row(0) = static_cast<std::byte>(index);
      return {};
    });
  };
  const auto held = get(1);
  for (std::uint64_t index = 2; index < 20; ++index) get(index);
  EXPECT_EQ(*held->row(0), std::byte{1});
}

TEST(BlockCache, ForgetsAFailureOnceItIsTold) {
  BlockCache cache(1 << 20);
  const auto failing = cache.get(0, 0, [](Block&) -> Result<void> { return fail(Error::Kind::Io, "gone"); });
  ASSERT_FALSE(failing);
  EXPECT_EQ(failing.error().message, "gone");
  EXPECT_TRUE(cache.get(0, 0, [](Block& fresh) -> Result<void> {
    fresh.reset(bytes_type, {0, 0, 1, 1});
    return {};
  }));
}

/// A source of 20 x 19 tiles, packed, and all of its texels.
struct Tiled {
  explicit Tiled(const std::string& path) {
    RasterFile file;
    file.width = 320;
    file.height = 300;
    file.bands = 3;
    file.options = {"TILED=YES", "BLOCKXSIZE=16", "BLOCKYSIZE=16", "COMPRESS=DEFLATE"};
    file.mask = true;
    write(file, path);
    options.names = {path};
    all = read_by_gdal(path, {0, 0, 320, 300}, {1, 2, 3});
  }
  SourceOptions options;
  GdalTexels all;
};

/// Reads windows that overlap, from many threads; whether all of their bytes are right.
bool read_from_many_threads(const Sources& sources, const GdalTexels& all) {
  std::atomic<bool> right{true};
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 8; ++t)
    threads.emplace_back([&, t] {
      std::mt19937 random(t);
      Block block;
      for (int i = 0; i < 60; ++i) {
        Window w{static_cast<int>(random() % 300), static_cast<int>(random() % 280), 0, 0};
        w.width = 1 + static_cast<int>(random() % static_cast<unsigned>(320 - w.x));
        w.height = 1 + static_cast<int>(random() % static_cast<unsigned>(300 - w.y));
        if (i == 0) w = {0, 0, 320, 300};
        block.reset(sources.type, w);
        if (!sources.rasters[0]->read(block)) right = false;
        for (int y = w.y; y < w.y + w.height; ++y)
          for (int x = 0; x < w.width; ++x) {
            const auto texel = static_cast<std::size_t>(y * 320 + w.x + x);
            right = right && block.valid_row(y)[x] == all.valid[texel];
            for (std::size_t b = 0; b < 3; ++b)
              right = right && std::to_integer<int>(block.row(y)[static_cast<std::size_t>(x) * 3 + b]) ==
                                   static_cast<int>(all.samples[texel * 3 + b]);
          }
      }
    });
  for (auto& thread : threads) thread.join();
  return right;
}

TEST(Decoding, HappensOnceABlockWhereTheCacheHoldsAll) {
  const TemporaryFolder folder;
  const Tiled tiled(folder.file("tiled.tif"));
  const auto sources = open_sources(tiled.options);
  ASSERT_TRUE(sources);
  EXPECT_EQ(sources->rasters[0]->block().width, 16);
  EXPECT_EQ(sources->rasters[0]->blocks(), 20 * 19);
  EXPECT_EQ(sources->rasters[0]->blocks_decoded(), 0);
  EXPECT_TRUE(read_from_many_threads(*sources, tiled.all));
  EXPECT_EQ(sources->rasters[0]->blocks_decoded(), 20 * 19);
}

TEST(Decoding, GivesTheSameBytesFromASmallCache) {
  const TemporaryFolder folder;
  Tiled tiled(folder.file("tiled.tif"));
  for (const std::uint64_t bytes : {0, 1 << 10, 50 << 10}) {
    tiled.options.cache_bytes = bytes;
    const auto sources = open_sources(tiled.options);
    ASSERT_TRUE(sources);
    EXPECT_TRUE(read_from_many_threads(*sources, tiled.all)) << bytes;
    EXPECT_GT(sources->rasters[0]->blocks_decoded(), 20 * 19) << "the cache no longer is too small";
  }
}

}  // namespace
}  // namespace nadir::mosaic

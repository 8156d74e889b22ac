#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <thread>

#include "nadir/transfer/disk_cache.h"
#include "support/small_disk.h"
#include "transfer/stand_in.h"

namespace nadir::transfer {
namespace {

namespace fs = std::filesystem;
using test::field;
using test::read;
using test::read_many;
using test::StandIn;
using test::Variable;
using testing::HasSubstr;

constexpr std::uint64_t block = DiskCache::block_bytes;

/// A server and a cache of their own for each test.
class CacheTest : public testing::Test {
 protected:
  CacheTest() {
    options.backoff_base_s = 0.01;
    options.cache_dir = folder.path() / "cache";
  }
  std::string bytes(std::uint64_t offset, std::size_t size) const { return server.bytes().substr(offset, size); }
  TransferOptions offline() const {
    TransferOptions without = options;
    without.offline = true;
    return without;
  }
  std::vector<fs::path> blocks() const {
    std::vector<fs::path> paths;
    if (fs::exists(options.cache_dir))
      for (const auto& entry : fs::recursive_directory_iterator(options.cache_dir))
        if (entry.path().extension() == ".block") paths.push_back(entry.path());
    return paths;
  }

  const Variable no_proxy{"no_proxy", "*"}, online{"NADIR_OFFLINE", nullptr};
  StandIn server;
  test::TemporaryFolder folder;
  TransferOptions options;
};

TEST_F(CacheTest, FetchesWholeBlocksOnceAndJoinsNeighbours) {
  const auto file = open_remote(server.url("plain"), options).value();
  EXPECT_EQ(field(server.asked("/plain/").at(0), "range"), "bytes=0-65535") << "opening brings a whole block";
  // In blocks 3, 4 and 5, and in the last one, which is short
  const auto reads = read_many(*file, {{3 * block + 10, 10}, {4 * block + 10, 10}, {5 * block, 1}, {999'990, 10}});
  ASSERT_TRUE(reads.ok);
  EXPECT_EQ(reads.texts[0], bytes(3 * block + 10, 10));
  EXPECT_EQ(reads.texts[3], bytes(999'990, 10));
  std::vector<std::string> ranges;
  for (const std::string& line : server.asked("/plain/")) ranges.push_back(field(line, "range"));
  EXPECT_THAT(ranges, testing::UnorderedElementsAre("bytes=0-65535", "bytes=196608-393215", "bytes=983040-999999"));

  EXPECT_EQ(read(*file, 4 * block, 2 * block), bytes(4 * block, 2 * block));
  EXPECT_EQ(server.asked("/plain/").size(), 3u);
  EXPECT_EQ(file->counters().cache_hits, 2u);
  EXPECT_EQ(blocks().size(), 5u);
}

TEST_F(CacheTest, ASecondOpeningOnlyAsksWhetherTheFileIsTheSame) {
  for (const char* how : {"plain", "weak"}) {
    read(*open_remote(server.url(how), options).value(), 500'000, 10);
    const Counters counted = process_counters();
    const auto file = open_remote(server.url(how), options).value();
    EXPECT_EQ(file->size(), 1'000'000u);
    EXPECT_EQ(read(*file, 500'000, 10), bytes(500'000, 10));
    EXPECT_EQ(read(*file, 0, 10), bytes(0, 10));
    EXPECT_EQ(process_counters().requests - counted.requests, 1u) << how;
    EXPECT_EQ(process_counters().bytes - counted.bytes, 0u) << how;
  }
}

TEST_F(CacheTest, AFileThatChangedSinceIsReadAnew) {
  const std::string url = server.url("skip=2,change");
  EXPECT_EQ(read(*open_remote(url, options).value(), 500'000, 10), bytes(500'000, 10));
  std::string changed = bytes(500'000, 10);
  for (char& byte : changed) byte = static_cast<char>(~byte);
  EXPECT_EQ(read(*open_remote(url, options).value(), 500'000, 10), changed);
}

TEST_F(CacheTest, OfflineServesWhatIsThereAndNamesWhatIsNot) {
  EXPECT_THAT(open_remote(server.url("plain"), offline()).error().message, HasSubstr("nothing of it is in the cache"));
  read(*open_remote(server.url("plain"), options).value(), 500'000, 10);
  server.stop();
  const auto file = open_remote(server.url("plain"), offline()).value();
  EXPECT_EQ(file->size(), 1'000'000u);
  EXPECT_EQ(read(*file, 500'000, 10), bytes(500'000, 10));
  EXPECT_EQ(read(*file, 0, 10), bytes(0, 10));
  EXPECT_THAT(read(*file, 700'000, 10),
              testing::AllOf(HasSubstr("offline"), HasSubstr("bytes 655360-720895"), HasSubstr("/plain/data.bin")));
  EXPECT_EQ(file->counters().requests, 0u);

  const Variable variable("NADIR_OFFLINE", "1");
  EXPECT_TRUE(open_remote(server.url("plain"), options));
  EXPECT_FALSE(open_remote(server.url("other"), options));
}

TEST_F(CacheTest, ANetworkThatFailsPointsToWhatTheCacheHas) {
  read(*open_remote(server.url("plain"), options).value(), 500'000, 10);
  server.stop();
  EXPECT_THAT(open_remote(server.url("plain"), options).error().message, HasSubstr("NADIR_OFFLINE=1"));
}

TEST_F(CacheTest, ADamagedBlockIsFetchedAgain) {
  read(*open_remote(server.url("plain"), options).value(), 500'000, 10);
  ASSERT_EQ(blocks().size(), 2u);
  for (const int damage : {0, 1, 2}) {
    for (const fs::path& path : blocks()) {
      std::string text = test::bytes_of(path);
      if (damage == 0) text[text.size() / 2] ^= 1;
      if (damage == 1) text.resize(text.size() / 2);
      if (damage == 2) text = test::bytes_of(blocks()[0]);  // whole, and another's: of one of the two
      std::ofstream(path, std::ios::binary) << text;
    }
    const auto file = open_remote(server.url("plain"), options).value();
    EXPECT_EQ(read(*file, 500'000, 10), bytes(500'000, 10)) << damage;
    EXPECT_EQ(read(*file, 0, 10), bytes(0, 10)) << damage;
    EXPECT_EQ(file->counters().requests, damage == 2 ? 2u : 3u) << "one that asks for the version, one a damaged block";
  }
}

TEST_F(CacheTest, KeepsWithinItsBudgetAndForgetsTheLeastRecentlyUsed) {
  options.cache_bytes = 5 * (block + 8) + 1000;  // five blocks and what is known of the file
  const auto file = open_remote(server.url("plain"), options).value();
  for (std::uint64_t i = 1; i < 5; ++i) read(*file, i * block, 10);
  EXPECT_EQ(file->counters().cache_failures, 0u);  // known once all is written
  EXPECT_EQ(blocks().size(), 5u);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // more than a tick of the clock that stamps files
  read(*file, 1 * block, 10);
  read(*file, 6 * block, 10);
  EXPECT_EQ(file->counters().cache_failures, 0u);
  std::uint64_t used = 0;
  for (const fs::path& path : blocks()) used += fs::file_size(path);
  EXPECT_LE(used, options.cache_bytes);
  const auto without = open_remote(server.url("plain"), offline());
  ASSERT_TRUE(without) << "what is known of the file goes last";
  EXPECT_EQ(read(**without, 1 * block, 10), bytes(1 * block, 10));
  EXPECT_EQ(read(**without, 6 * block, 10), bytes(6 * block, 10));
  EXPECT_THAT(read(**without, 0, 10), HasSubstr("not in the cache"));
}

TEST_F(CacheTest, AFullDiskOnlyEndsTheCaching) {
  const test::SmallDisk disk(1000);
  const auto file = open_remote(server.url("plain"), options).value();
  EXPECT_EQ(read(*file, 500'000, 10), bytes(500'000, 10));
  EXPECT_EQ(read(*file, 300'000, 100'000), bytes(300'000, 100'000));
  EXPECT_GE(file->counters().cache_failures, 1u);
  EXPECT_EQ(blocks().size(), 0u);
}

TEST_F(CacheTest, AFolderThatCannotBeMadeOnlyEndsTheCaching) {
  options.cache_dir = folder.write("file", "") + "/cache";
  const auto file = open_remote(server.url("plain"), options).value();
  EXPECT_EQ(read(*file, 500'000, 10), bytes(500'000, 10));
  EXPECT_GE(file->counters().cache_failures, 1u);
}

TEST_F(CacheTest, NothingIsKeptOfWhatCannotBeRecognised) {
  const auto file = open_remote(server.url("noetag,nodate"), options).value();
  EXPECT_EQ(read(*file, 500'000, 10), bytes(500'000, 10));
  EXPECT_TRUE(blocks().empty());
}

TEST_F(CacheTest, ANewSignatureInALinkFindsTheOldBlocks) {
  read(*open_remote(server.url("plain") + "?sv=2024&se=monday&sig=a&id=7", options).value(), 500'000, 10);
  EXPECT_TRUE(open_remote(server.url("plain") + "?sv=2024&se=friday&sig=b&id=7", offline()));
  EXPECT_FALSE(open_remote(server.url("plain") + "?sv=2024&se=friday&sig=b&id=8", offline()));
  for (const auto& entry : fs::recursive_directory_iterator(options.cache_dir)) {
    if (!entry.is_regular_file()) continue;
    EXPECT_EQ(test::bytes_of(entry.path()).find("sig="), std::string::npos) << entry.path();
  }
}

TEST_F(CacheTest, OthersMayNotLookIntoTheFolder) {
  read(*open_remote(server.url("plain"), options).value(), 500'000, 10);
  struct stat status = {};
  ASSERT_EQ(::stat(options.cache_dir.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0700u);
}

TEST_F(CacheTest, SeveralCachesOnOneFolderGiveRightBytesOrNone) {
  // As several processes would: caches that know nothing of each other, on a budget that keeps them making room.
  const FileVersion version{1'000'000, "\"v1\"", ""};
  const DiskCache::FileKey key = DiskCache::file_key("http://host/map.tif", version);
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0}, right{0};
  for (unsigned t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      DiskCache cache(options.cache_dir, 6 * block);
      std::mt19937 random(t);
      std::string text(block, '\0');
      for (int i = 0; i < 100; ++i) {
        const std::uint64_t index = random() % 12;
        const std::string block_text = bytes(index * block, block);
        cache.store(key, index, std::as_bytes(std::span(block_text)), [&] { ++wrong; });
        const std::uint64_t other = random() % 12;
        if (!cache.load(key, other, std::as_writable_bytes(std::span(text)))) continue;
        ++(text == bytes(other * block, block) ? right : wrong);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(right, 0);
}

}  // namespace
}  // namespace nadir::transfer

#include "journal.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "support/temporary_folder.h"

namespace nadir::pyramid {
namespace {
namespace fs = std::filesystem;

ChunkRecord record(int i) {
  return {i % 3,
          {i, 2 * i},
          true,
          static_cast<std::uint64_t>(1000 * i),
          {{10, 0}, {static_cast<std::uint32_t>(i), 7}},
          {0.5f, static_cast<float>(i)},
          77,
          {{5, -1.0, 2.0, 0.25, 9.0}}};
}

class JournalFile : public testing::Test {
 protected:
  Result<Journal> open(const BuildIdentity& identity = {{1, 2}, 512, 2, 0, 1}) const {
    auto file = DiskFile::open(path());
    EXPECT_TRUE(file);
    return Journal::open(std::move(*file), identity);
  }
  fs::path path() const { return folder_.path() / "journal"; }

  void write_records(int count) const {
    auto journal = open();
    ASSERT_TRUE(journal);
    for (int i = 0; i < count; ++i) ASSERT_TRUE(journal->append(record(i)));
  }

  test::TemporaryFolder folder_;
};

TEST_F(JournalFile, WhatWasAppendedIsThereAgain) {
  write_records(5);
  const auto journal = open();
  ASSERT_TRUE(journal);
  EXPECT_FALSE(journal->is_new());
  ASSERT_EQ(journal->records().size(), 5u);
  for (int i = 0; i < 5; ++i) {
    const ChunkRecord expected = record(i), &found = journal->records()[static_cast<std::size_t>(i)];
    EXPECT_EQ(found.stage, expected.stage);
    EXPECT_EQ(found.chunk, expected.chunk);
    EXPECT_EQ(found.tiles_at, expected.tiles_at);
    EXPECT_EQ(found.tiles[1].imagery, expected.tiles[1].imagery);
    EXPECT_EQ(found.tiles[1].mask, expected.tiles[1].mask);
    EXPECT_EQ(found.losses, expected.losses);
    EXPECT_EQ(found.handed_on_at, expected.handed_on_at);
    EXPECT_EQ(found.statistics[0].sum_of_squares, expected.statistics[0].sum_of_squares);
  }
}

TEST_F(JournalFile, OneOfAnotherBuildIsBegunAnew) {
  write_records(5);
  const auto other = open({{1, 3}, 512, 2, 0, 1});
  ASSERT_TRUE(other);
  EXPECT_TRUE(other->is_new());
  EXPECT_TRUE(other->records().empty());
}

TEST_F(JournalFile, CutAtAnyByteItKeepsTheRecordsBefore) {
  write_records(4);
  const auto whole = fs::file_size(path());
  for (std::uintmax_t bytes = 0; bytes < whole; ++bytes) {
    fs::remove(path());
    write_records(4);
    fs::resize_file(path(), bytes);
    auto journal = open();
    ASSERT_TRUE(journal) << bytes;
    EXPECT_LT(journal->records().size(), 4u);
    const std::size_t kept = journal->records().size();
    ASSERT_TRUE(journal->append(record(9)));  // behind what was kept, not behind the fragment
    const auto again = open();
    ASSERT_TRUE(again);
    ASSERT_EQ(again->records().size(), kept + 1) << bytes;
    EXPECT_EQ(again->records().back().chunk.col, 9);
  }
}

TEST_F(JournalFile, AChangedByteIsNeverBelieved) {
  write_records(4);
  std::ifstream in(path(), std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x41);
    std::ofstream(path(), std::ios::binary) << damaged;
    const auto journal = open();
    ASSERT_TRUE(journal) << at;
    EXPECT_LT(journal->records().size(), 4u) << at;
    for (std::size_t i = 0; i < journal->records().size(); ++i)
      EXPECT_EQ(journal->records()[i].tiles_at, record(static_cast<int>(i)).tiles_at) << at;
  }
}

TEST_F(JournalFile, NoiseIsNoJournal) {
  std::mt19937 random(4);
  for (int i = 0; i < 50; ++i) {
    std::ofstream out(path(), std::ios::binary);
    for (unsigned k = 0; k < random() % 500; ++k) out << static_cast<char>(random());
    out.close();
    const auto journal = open();
    ASSERT_TRUE(journal);
    EXPECT_TRUE(journal->is_new());
  }
}

}  // namespace
}  // namespace nadir::pyramid

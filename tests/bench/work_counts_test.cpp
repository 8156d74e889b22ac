#include "work_counts.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <new>

#include "allocations.h"
#include "support/temporary_folder.h"

namespace nadir::bench {
namespace {

TEST(WorkCounts, DifferencesAreToldByNameAndInstructionsMayMoveALittle) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("expected.csv");
  auto nothing = ExpectedCounts::read(path).value();
  EXPECT_NE(nothing.differences("view", "best", {{"cells", 3}}).find("nothing is expected"), std::string::npos);
  ASSERT_TRUE(nothing.replace("view", "best", {{"cells", 3}, {"instructions", 1000}}));
  ASSERT_TRUE(nothing.replace("view", "draft", {{"cells", 2}}));

  const auto expected = ExpectedCounts::read(path).value();
  EXPECT_EQ(expected.differences("view", "best", {{"cells", 3}, {"instructions", 1019}}), "");
  EXPECT_EQ(expected.differences("view", "best", {{"cells", 4}, {"instructions", 1021}}),
            "cells: expected 3, found 4, instructions: expected 1000, found 1021");
  EXPECT_EQ(expected.differences("view", "draft", {{"tiles", 1}}), "tiles: expected none, found 1");
}

TEST(WorkCounts, AFileThatIsNoneIsSaidWithItsLine) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("expected.csv")) << "case,method,counter,count\nview,best,cells\n";
  const auto expected = ExpectedCounts::read(folder.file("expected.csv"));
  ASSERT_FALSE(expected);
  EXPECT_NE(expected.error().message.find("expected.csv:2"), std::string::npos);
}

TEST(WorkCounts, AllocationsAreCounted) {
  const std::int64_t before = allocations();
  ::operator delete(::operator new(3));
  constexpr std::align_val_t line{64};
  void* aligned = ::operator new(100, line);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(aligned) % 64, 0u);
  ::operator delete(aligned, line);
  EXPECT_EQ(allocations() - before, 2);
}

}  // namespace
}  // namespace nadir::bench

#include "nadir/base/files.h"

#include <gtest/gtest.h>

#include "support/small_disk.h"
#include "support/temporary_folder.h"

namespace nadir {
namespace {

TEST(WriteFile, HoldsAllOrWhatItHeldBefore) {
  const test::TemporaryFolder folder;
  const std::string path = folder.write("a.txt", "before");
  {
    const test::SmallDisk disk(1000);
    const auto written = write_file(path, std::string(5000, 'x'));
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().kind, Error::Kind::Io);
    EXPECT_NE(written.error().message.find("a.txt"), std::string::npos);
  }
  EXPECT_EQ(read_text_file(path).value(), "before");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "nothing else is left behind";
  ASSERT_TRUE(write_file(path, "after"));
  EXPECT_EQ(read_text_file(path).value(), "after");
}

TEST(ReadTextFile, SaysWhatIsWrong) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(read_text_file(folder.file("none")).error().kind, Error::Kind::NotFound);
  EXPECT_EQ(read_text_file(folder.path()).error().kind, Error::Kind::Malformed) << "a folder is no text";
  EXPECT_EQ(read_text_file(folder.write("long", std::string(100, 'x')), 10).error().kind, Error::Kind::Malformed);
}

TEST(RefuseToOverwrite, ProtectsFilesAndFilledFolders) {
  const test::TemporaryFolder folder;
  const std::string file = folder.write("sub/a.txt", "x");
  std::filesystem::create_directory(folder.path() / "empty");
  EXPECT_FALSE(refuse_to_overwrite(file, false));
  EXPECT_FALSE(refuse_to_overwrite(folder.path() / "sub", false));
  EXPECT_TRUE(refuse_to_overwrite(folder.path() / "sub", true));
  EXPECT_TRUE(refuse_to_overwrite(folder.path() / "empty", false));
  EXPECT_TRUE(refuse_to_overwrite(folder.path() / "none", false));
}

}  // namespace
}  // namespace nadir

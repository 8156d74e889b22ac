#include "nadir/base/byte_source.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <chrono>
#include <filesystem>

#include "support/temporary_folder.h"

namespace nadir {
namespace {

std::string read(const ByteSource& source, std::uint64_t offset, std::size_t size) {
  std::string text(size, '?');
  const auto ok = source.read(offset, std::as_writable_bytes(std::span(text)));
  return ok ? text : "error: " + ok.error().message;
}

TEST(LocalFile, GivesTheBytesAskedForOrAnError) {
  const test::TemporaryFolder folder;
  const auto file = LocalFile::open(folder.write("f", "0123456789")).value();
  EXPECT_EQ(file->size(), 10u);
  EXPECT_EQ(read(*file, 3, 4), "3456");
  EXPECT_EQ(read(*file, 10, 0), "");
  EXPECT_NE(read(*file, 8, 4).find("ends at byte 10"), std::string::npos) << read(*file, 8, 4);
}

TEST(LocalFile, ReadsSeveralRangesAtOnce) {
  const test::TemporaryFolder folder;
  const auto file = LocalFile::open(folder.write("f", "0123456789")).value();
  std::array<std::byte, 2> a, b;
  const std::array requests = {ByteRequest{7, a}, ByteRequest{0, b}};
  ASSERT_TRUE(file->read_many(requests));
  EXPECT_EQ(static_cast<char>(a[1]), '8');
  EXPECT_EQ(static_cast<char>(b[1]), '1');
}

TEST(LocalFile, RefusesWhatIsNoFile) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(LocalFile::open(folder.file("missing")).error().kind, Error::Kind::NotFound);
  EXPECT_EQ(LocalFile::open(folder.path().string()).error().kind, Error::Kind::Malformed);
  ASSERT_EQ(::mkfifo(folder.file("pipe").c_str(), 0600), 0);
  EXPECT_EQ(LocalFile::open(folder.file("pipe")).error().kind, Error::Kind::Malformed)
      << "without waiting for a writer";
}

TEST(LocalFile, AFileThatShrinksIsAnError) {
  const test::TemporaryFolder folder;
  const auto file = LocalFile::open(folder.write("f", "0123456789")).value();
  std::filesystem::resize_file(folder.file("f"), 5);
  EXPECT_EQ(read(*file, 0, 5), "01234");
  EXPECT_NE(read(*file, 0, 6).find("it had 10 bytes"), std::string::npos);
}

TEST(LocalFile, AFileThatIsWrittenToIsAnErrorWhereThatMatters) {
  const test::TemporaryFolder folder;
  const std::string path = folder.write("f", "0123456789");
  std::filesystem::last_write_time(path, std::filesystem::last_write_time(path) - std::chrono::seconds(10));
  const auto careless = LocalFile::open(path).value(), careful = LocalFile::open(path, IfWritten::Fail).value();
  EXPECT_EQ(read(*careful, 0, 3), "012");
  folder.write("f", "abcdefghij");
  EXPECT_EQ(read(*careless, 0, 3), "abc");
  EXPECT_NE(read(*careful, 0, 3).find(path + ": was written to"), std::string::npos) << read(*careful, 0, 3);
}

TEST(LocalFile, AFileThatIsDeletedOrReplacedIsReadOnAsItWas) {
  const test::TemporaryFolder folder;
  const std::string path = folder.write("f", "0123456789");
  const auto file = LocalFile::open(path, IfWritten::Fail).value();
  std::filesystem::rename(folder.write("g", "abcdefghij"), path);
  EXPECT_EQ(read(*file, 0, 3), "012");
  std::filesystem::remove(path);
  EXPECT_EQ(read(*file, 3, 3), "345");
}

}  // namespace
}  // namespace nadir

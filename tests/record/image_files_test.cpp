#include "nadir/record/image_files.h"

#include <gtest/gtest.h>

#include <link.h>
#include <signal.h>
#include <sys/resource.h>
#include <fstream>

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>
#include <thread>

#include "support/small_disk.h"
#include "nadir/base/module.h"
#include "support/temporary_folder.h"

namespace nadir::record {
namespace {
namespace fs = std::filesystem;
using tile::SampleType;

/// Names of the shared libraries in this process.
std::string loaded_libraries() {
  std::string names;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* out) {
        static_cast<std::string*>(out)->append(info->dlpi_name).append("\n");
        return 0;
      },
      &names);
  return names;
}

const std::string libraries_at_start = loaded_libraries();  // before main, so before any image

/// Noise over the whole range of the type, extremes included.
Image noise(SampleType type, int width, int height, int channels, unsigned seed = 1) {
  Image image{{}, type, width, height, channels};
  image.samples.resize(image.view().size_bytes());
  std::mt19937 random(seed);
  for (std::byte& byte : image.samples) byte = static_cast<std::byte>(random());
  if (type == SampleType::Float32) {  // bit patterns would be NaNs with payloads; values are what matters
    std::uniform_real_distribution<float> decibels(-40, 10);
    for (std::size_t i = 0; i + 4 <= image.samples.size(); i += 4) {
      const float value = i % 52 == 0 ? NAN : decibels(random);
      std::memcpy(&image.samples[i], &value, 4);
    }
  }
  return image;
}

const ImageFiles& files() {
  static const ImageFiles* loaded = image_files().value();
  return *loaded;
}

struct Case {
  const char* extension;
  SampleType type;
  int channels;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.extension << " " << tile::to_string(c.type) << " x" << c.channels;
}

class RoundTrip : public testing::TestWithParam<Case> {};

TEST_P(RoundTrip, GivesBackEveryBit) {
  const test::TemporaryFolder folder;
  const auto [extension, type, channels] = GetParam();
  const fs::path path = folder.path() / (std::string("image") + extension);
  const Image out = noise(type, 37, 23, channels);  // odd sizes show a wrong row length
  ASSERT_TRUE(files().write(path, out.view()));
  const auto in = files().read(path);
  ASSERT_TRUE(in) << in.error().message;
  EXPECT_EQ(in->type, type);
  EXPECT_EQ(in->width, 37);
  EXPECT_EQ(in->height, 23);
  EXPECT_EQ(in->channels, channels);
  EXPECT_TRUE(in->samples == out.samples);
}

INSTANTIATE_TEST_SUITE_P(EveryTypeAndChannelCount, RoundTrip, [] {
  std::vector<Case> cases;
  for (const int channels : {1, 2, 3, 4, 5, 13}) {
    for (const SampleType type : {SampleType::UInt8, SampleType::Int16, SampleType::UInt16, SampleType::Float32}) {
      cases.push_back({".tif", type, channels});
      if (channels <= 4 && (type == SampleType::UInt8 || type == SampleType::UInt16))
        cases.push_back({".png", type, channels});
    }
  }
  return testing::ValuesIn(cases);
}());

TEST(ImageFiles, AFormatThatCannotHoldTheImageIsRefusedAndNothingWritten) {
  const test::TemporaryFolder folder;
  const Case refused[] = {{".png", SampleType::Float32, 1},
                          {".png", SampleType::Int16, 1},
                          {".png", SampleType::UInt8, 5},
                          {".jpg", SampleType::UInt8, 3},
                          {"", SampleType::UInt8, 3}};
  for (const auto& [extension, type, channels] : refused) {
    const fs::path path = folder.path() / (std::string("image") + extension);
    const auto written = files().write(path, noise(type, 8, 8, channels).view());
    ASSERT_FALSE(written) << extension;
    EXPECT_EQ(written.error().kind, Error::Kind::Unsupported);
    EXPECT_NE(written.error().message.find(path.string()), std::string::npos) << written.error().message;
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(ImageFiles, TheSamePixelsGiveTheSameBytesWithoutWhenOrByWhat) {
  const test::TemporaryFolder folder;
  for (const char* extension : {".png", ".tif"}) {
    const Image image = noise(SampleType::UInt8, 64, 48, 3);
    const fs::path first = folder.path() / (std::string("a") + extension),
                   second = folder.path() / "sub" / (std::string("b") + extension);
    ASSERT_TRUE(files().write(first, image.view()));
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // formats keep time in seconds
    ASSERT_TRUE(files().write(second, image.view()));
    const std::string bytes = test::bytes_of(first);
    EXPECT_EQ(bytes, test::bytes_of(second));
    for (const char* metadata : {"OpenImageIO", "Software", "DateTime", "tIME", "HostComputer"})
      EXPECT_EQ(bytes.find(metadata), std::string::npos) << extension << " tells " << metadata;
  }
}

TEST(ImageFiles, AFullDiskIsAnErrorWithFileAndCauseAndKeepsWhatWasThere) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "frame.png";
  const Image small = noise(SampleType::UInt8, 16, 16, 3), large = noise(SampleType::UInt8, 200, 200, 3);
  ASSERT_TRUE(files().write(path, small.view()));
  const std::string before = test::bytes_of(path);

  const auto [over_old, tiff] = [&] {
    const test::SmallDisk disk(4096);  // full in the middle of a write
    return std::pair(files().write(path, large.view()), files().write(folder.path() / "other.tif", large.view()));
  }();

  for (const auto* written : {&over_old, &tiff}) {
    ASSERT_FALSE(*written);
    EXPECT_EQ(written->error().kind, Error::Kind::Io);
    EXPECT_NE(written->error().message.find("File too large"), std::string::npos) << written->error().message;
  }
  EXPECT_NE(over_old.error().message.find(path.string()), std::string::npos) << over_old.error().message;
  EXPECT_EQ(test::bytes_of(path), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1) << "a partial file was left";
  EXPECT_TRUE(files().write(path, large.view())) << "the limit, not the file, was what failed";
}

TEST(ImageFiles, AFileCutAnywhereInItsPixelsIsAnErrorAndNoCrash) {
  const test::TemporaryFolder folder;
  for (const char* extension : {".png", ".tif"}) {
    const fs::path whole = folder.path() / (std::string("whole") + extension),
                   cut = folder.path() / (std::string("cut") + extension);
    ASSERT_TRUE(files().write(whole, noise(SampleType::UInt16, 24, 20, 3).view()));
    const std::string bytes = test::bytes_of(whole);
    // A PNG ends with 12 bytes that hold nothing, after a checksum of 4
    const std::size_t needed = bytes.size() - (extension == std::string(".png") ? 16 : 0);
    for (std::size_t length = 0; length < needed; length += 7) {
      std::ofstream(cut, std::ios::binary) << bytes.substr(0, length);
      EXPECT_FALSE(files().read(cut)) << extension << " of " << length << " of " << bytes.size() << " bytes";
    }
  }
  const auto missing = files().read(folder.path() / "missing.png");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, Error::Kind::NotFound);
}

TEST(ImageFiles, AHeaderThatClaimsMorePixelsThanTheFileCanHoldIsRefusedBeforeAllocating) {
  const test::TemporaryFolder folder;
  const fs::path path = folder.path() / "claim.tif";
  ASSERT_TRUE(files().write(path, noise(SampleType::UInt8, 60, 60, 3).view()));
  std::string bytes = test::bytes_of(path);
  const auto set_tag = [&](std::uint16_t tag) {  // little-endian entry: tag, type, count 1, value
    for (std::size_t i = 8; i + 12 <= bytes.size(); ++i) {
      std::uint16_t found, type;
      std::uint32_t count, value;
      std::memcpy(&found, &bytes[i], 2), std::memcpy(&type, &bytes[i + 2], 2);
      std::memcpy(&count, &bytes[i + 4], 4), std::memcpy(&value, &bytes[i + 8], 4);
      if (found != tag || count != 1 || value != 60 || (type != 3 && type != 4)) continue;
      const std::uint16_t as_long = 4;
      const std::uint32_t huge = 60000;
      std::memcpy(&bytes[i + 2], &as_long, 2), std::memcpy(&bytes[i + 8], &huge, 4);
      return true;
    }
    return false;
  };
  ASSERT_TRUE(set_tag(256) && set_tag(257)) << "width and height not found in the file";
  std::ofstream(path, std::ios::binary) << bytes;
  const auto read = files().read(path);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, Error::Kind::Malformed);
  EXPECT_NE(read.error().message.find("60000x60000"), std::string::npos) << read.error().message;
}

TEST(ImageFiles, OpenImageIoAndOpenCvComeWithTheFirstImageOnly) {
  for (const char* library : {"libOpenImageIO", "libopencv"})
    EXPECT_EQ(libraries_at_start.find(library), std::string::npos) << library << " is linked";
  files();
  EXPECT_NE(loaded_libraries().find("libOpenImageIO"), std::string::npos) << "this test looks for the wrong name";
}

TEST(ImageFiles, WithoutTheModuleTheErrorTellsWhereItWasLookedForAndWhatToDo) {
  const test::TemporaryFolder folder;
  const auto missing = load_image_files(std::array{folder.path()});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, Error::Kind::NotFound);
  for (const std::string& part : {folder.path().string(), std::string("OpenImageIO"), std::string("NADIR_MODULES")})
    EXPECT_NE(missing.error().message.find(part), std::string::npos) << missing.error().message;

  std::ofstream(folder.path() / "nadir_images.so") << "not a library";
  const auto broken = load_image_files(std::array{folder.path()});
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().kind, Error::Kind::Unsupported);
  EXPECT_NE(broken.error().message.find("nadir_images.so"), std::string::npos) << broken.error().message;
}

TEST(ImageFiles, TheFolderThatNadirModulesNamesIsSearchedLast) {
  const char* set = std::getenv("NADIR_MODULES");
  const std::string before = set ? set : "";
  setenv("NADIR_MODULES", "/somewhere/else", 1);
  const auto folders = nadir::module_folders();
  setenv("NADIR_MODULES", "", 1);
  const auto without = module_folders();
  setenv("NADIR_MODULES", before.c_str(), 1);
  ASSERT_EQ(folders.size(), 3u);
  EXPECT_EQ(folders.front(), fs::read_symlink("/proc/self/exe").parent_path());
  EXPECT_EQ(folders.back(), "/somewhere/else");
  EXPECT_EQ(without.size(), 2u);
}

}  // namespace
}  // namespace nadir::record

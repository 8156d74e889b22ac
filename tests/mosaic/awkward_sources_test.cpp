#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "mosaic/raster_file.h"
#include "nadir/mosaic/source.h"

// Odd and damaged files of other people's test suites (tests/data/README.md tells whose).
namespace nadir::mosaic {
namespace {

namespace fs = std::filesystem;

/// All files of a folder whose names say that they are damaged, or that they are not.
std::vector<std::string> files(bool damaged) {
  std::vector<std::string> names;
  const char* folder = std::getenv("NADIR_AWKWARD_FILES");  // more of them
  for (const auto& entry : fs::recursive_directory_iterator(folder ? folder : NADIR_SOURCE_DIR "/tests/data/awkward")) {
    const std::string path = entry.path().string();
    if (entry.path().extension() == ".tif" && (path.find("corrupt") != std::string::npos) == damaged)
      names.push_back(path);
  }
  std::sort(names.begin(), names.end());
  return names;
}

Result<Sources> open(const std::string& path) {
  SourceOptions options;
  options.names = {path};
  return open_sources(options);
}

/// Reads a few rows at a time of a raster of any claimed size, in all no more than a moment takes.
Result<void> read_some(const Sources& sources, std::int64_t rows_in_all) {
  const Source& source = *sources.rasters.front();
  const auto width = static_cast<std::int32_t>(std::min<std::int64_t>(source.width(), 4096));
  Block block;
  for (std::int64_t y = 0; y < std::min(source.height(), rows_in_all); y += 64) {
    block.reset(sources.type, {0, static_cast<std::int32_t>(y), width,
                               static_cast<std::int32_t>(std::min<std::int64_t>(64, source.height() - y))});
    if (auto ok = source.read(block); !ok) return ok;
  }
  return {};
}

TEST(AwkwardSources, ThatAreWholeAreReadAsGdalReadsThem) {
  // Not read by GDAL 3.6 either.
  const std::set<std::string> refused = {"bit_depth__uint33.tif", "codec__unknown_compression.tif",
                                         "ycbcr_jpeg__mandrilmini_12bitjpeg.tif", "codec__byte_JXL.tif",
                                         "codec__unsupported_codec_jp2000.tif"};
  int compared = 0;
  for (const std::string& path : files(false)) {
    SCOPED_TRACE(path);
    const auto sources = open(path);
    if (!sources) {
      EXPECT_TRUE(refused.contains(fs::path(path).filename().string())) << sources.error().message;
      EXPECT_TRUE(sources.error().message.starts_with(path)) << sources.error().message;
      continue;
    }
    const Source& source = *sources->rasters.front();
    std::vector<int> bands = source.description().data_bands();
    if (sources->type.alpha)
      for (int b = 1; b <= static_cast<int>(source.description().bands.size()); ++b)
        if (source.description().bands[static_cast<std::size_t>(b) - 1].color == "Alpha") bands.push_back(b);
    const bool complex = source.description().bands[0].stored_type.starts_with("C");
    if (complex || static_cast<int>(bands.size()) != sources->type.bands ||
        source.description().bands[0].stored_type == "Int8") {
      EXPECT_TRUE(read_some(*sources, 1 << 14));
      continue;
    }
    for (const Window& window :
         windows_of(std::min<std::int64_t>(source.width(), 3000), std::min<std::int64_t>(source.height(), 3000))) {
      Block block(sources->type, window);
      const auto read = source.read(block);
      if (!read && refused.contains(fs::path(path).filename().string())) break;
      ASSERT_TRUE(read) << read.error().message;
      const GdalTexels expected = read_by_gdal(path, window, bands);
      EXPECT_TRUE(same_samples(samples_of(block, sources->type), expected.samples));
      if (sources->type.mask) {
        EXPECT_EQ(validity_of(block), expected.valid);
      }
    }
    ++compared;
  }
  EXPECT_GE(compared, 20);
}

TEST(AwkwardSources, ThatAreDamagedAreErrorsThatNameThem) {
  // GDAL finds out where its strips end, and so it is read.
  const std::set<std::string> repaired = {"stripbytecounts_count_not_same_as_stripoffsets_count.tif"};
  int refused = 0;
  for (const std::string& path : files(true)) {
    SCOPED_TRACE(path);
    const auto sources = open(path);
    const auto done = sources ? read_some(*sources, 1 << 20) : Result<void>(fail(sources));
    if (done) {
      EXPECT_TRUE(repaired.contains(fs::path(path).filename().string()));
      continue;
    }
    ++refused;
    EXPECT_TRUE(done.error().message.starts_with(path)) << done.error().message;
    EXPECT_EQ(done.error().message.find('\n'), std::string::npos) << done.error().message;
    EXPECT_LT(done.error().message.size(), path.size() + 400) << done.error().message;
  }
  EXPECT_GE(refused, 10);
}

}  // namespace
}  // namespace nadir::mosaic

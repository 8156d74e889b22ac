#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "mosaic/raster_file.h"
#include "nadir/mosaic/source.h"
#include "support/temporary_folder.h"

// Names to rasters, and rasters beyond what a process may open.
namespace nadir::mosaic {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;
using Labels = std::vector<std::string>;

RasterFile small(double value) {
  RasterFile file;
  file.width = file.height = 4;
  file.value = [=](int, int, int) { return value; };
  return file;
}

Result<Sources> open(Labels names, std::optional<int> zoom = std::nullopt) {
  SourceOptions options;
  options.names = std::move(names);
  options.zoom = zoom;
  return open_sources(options);
}

Labels labels_of(const Result<Sources>& sources) {
  Labels labels;
  EXPECT_TRUE(sources) << sources.error().message;
  if (sources)
    for (const auto& source : sources->rasters) labels.push_back(source->label());
  return labels;
}

double texel_of(const Sources& sources, std::size_t index) {
  Block block(sources.type, {2, 2, 1, 1});
  const auto read = sources.rasters[index]->read(block);
  EXPECT_TRUE(read) << read.error().message;
  return samples_of(block, sources.type).front();
}

TEST(Names, OfAFolderMeanItsRastersByName) {
  const TemporaryFolder folder;
  fs::create_directory(folder.file("maps"));
  fs::create_directory(folder.file("maps/older"));
  for (const char* name : {"b.tif", "a.TIFF", "older/c.tif"}) write(small(1), folder.file(std::string("maps/") + name));
  folder.write("maps/readme.md", "no raster");
  folder.write("maps/a.TIFF.aux.xml", "<PAMDataset></PAMDataset>");
  EXPECT_EQ(labels_of(open({folder.file("maps")})), (Labels{folder.file("maps/a.TIFF"), folder.file("maps/b.tif")}));
  fs::remove(folder.file("maps/a.TIFF"));
  fs::remove(folder.file("maps/b.tif"));
  EXPECT_EQ(labels_of(open({folder.file("maps")})), Labels{folder.file("maps/older/c.tif")});
  fs::remove(folder.file("maps/older/c.tif"));
  const auto none = open({folder.file("maps")});
  ASSERT_FALSE(none);
  EXPECT_TRUE(none.error().message.starts_with(folder.file("maps") + ": expected rasters")) << none.error().message;
}

TEST(Names, InAListAreRelativeToIt) {
  const TemporaryFolder folder;
  fs::create_directory(folder.file("maps"));
  write(small(1), folder.file("maps/a.tif"));
  write(small(2), folder.file("maps/b.tif"));
  folder.write("maps/list.txt", "# flown in May\nb.tif\r\n\n  a.tif \n" + folder.file("maps/b.tif") + "\n");
  EXPECT_EQ(labels_of(open({folder.file("maps/list.txt")})),
            (Labels{folder.file("maps/b.tif"), folder.file("maps/a.tif"), folder.file("maps/b.tif")}));
  folder.write("maps/list.txt", "b.tif\nmissing.tif\n");
  const auto missing = open({folder.file("maps/list.txt")});
  ASSERT_FALSE(missing);
  EXPECT_TRUE(missing.error().message.starts_with(folder.file("maps/list.txt") + ": line 2: "))
      << missing.error().message;
  folder.write("maps/list.txt", "list.txt\n");
  EXPECT_NE(open({folder.file("maps/list.txt")}).error().message.find("circle"), std::string::npos);
  folder.write("maps/list.txt", "\n");
  EXPECT_EQ(open({folder.file("maps/list.txt")}).error().kind, Error::Kind::NotFound);
}

TEST(Names, OfAFolderOfMapTilesMeanItsDeepestZoomOrTheOneAsked) {
  const TemporaryFolder folder;
  RasterFile tile;
  tile.width = tile.height = 256;
  tile.driver = "PNG";
  tile.crs = "";
  for (const char* path : {"tiles/3/2/1.png", "tiles/4/5/6.png", "tiles/4/6/6.png"}) {
    fs::create_directories(fs::path(folder.file(path)).parent_path());
    tile.bands = path[6] == '3' ? 1 : 3;
    write(tile, folder.file(path));
  }
  const auto deepest = open({folder.file("tiles")});
  ASSERT_EQ(labels_of(deepest), Labels{folder.file("tiles")});
  EXPECT_EQ(deepest->rasters[0]->width(), 512);
  EXPECT_TRUE(deepest->type.alpha);
  Block block(deepest->type, {300, 100, 9, 9});
  ASSERT_TRUE(deepest->rasters[0]->read(block));
  const GdalTexels expected = read_by_gdal(folder.file("tiles/4/6/6.png"), {300 - 256, 100, 9, 9}, {1, 2, 3});
  const auto samples = samples_of(block, deepest->type);
  for (std::size_t i = 0; i < 81; ++i) {
    for (std::size_t b = 0; b < 3; ++b) ASSERT_EQ(samples[i * 4 + b], expected.samples[i * 3 + b]);
    ASSERT_EQ(samples[i * 4 + 3], 255);
  }
  EXPECT_EQ(open({folder.file("tiles")}, 3)->rasters[0]->width(), 256);
  EXPECT_NE(open({folder.file("tiles")}, 9).error().message.find("zoom 9"), std::string::npos);
}

TEST(Names, OfWhatIsNoRasterAreErrorsThatNameIt) {
  const TemporaryFolder folder;
  write(small(1), folder.file("good.tif"));
  EXPECT_EQ(open({folder.file("good.tif"), folder.file("absent.tif")}).error().message,
            folder.file("absent.tif") + ": no such file");
  const std::string text = folder.write("text.tif", "not a raster");
  const auto bad = open({folder.file("good.tif"), text});
  EXPECT_TRUE(bad.error().message.starts_with(text + ": expected a raster")) << bad.error().message;
  EXPECT_FALSE(open({}));
}

TEST(ChangedSource, IsAnErrorThatNamesIt) {
  const TemporaryFolder folder;
  for (const char* compression : {"NONE", "DEFLATE", "PACKBITS"}) {
    const std::string path = folder.file(std::string(compression) + ".tif");
    RasterFile file = small(1);
    file.options = {std::string("COMPRESS=") + compression};
    write(file, path);
    const auto sources = open({path});
    ASSERT_TRUE(sources);
    EXPECT_EQ(texel_of(*sources, 0), 1);
    Block block(sources->type, {0, 0, 4, 4});
    const auto fresh = open({path});
    fs::last_write_time(path, fs::last_write_time(path) + std::chrono::seconds(5));
    const auto changed = fresh->rasters[0]->read(block);
    ASSERT_FALSE(changed);
    EXPECT_TRUE(changed.error().message.starts_with(path + ": has changed")) << changed.error().message;
    fs::remove(path);
    const auto gone = fresh->rasters[0]->read(block);
    ASSERT_FALSE(gone);
    EXPECT_TRUE(gone.error().message.starts_with(path + ": has gone")) << gone.error().message;
  }
}

/// A process that may open few files, while in scope.
class FewFiles {
 public:
  explicit FewFiles(rlim_t files) {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const rlimit limit{files, before_.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &limit);
  }
  ~FewFiles() { ::setrlimit(RLIMIT_NOFILE, &before_); }
  FewFiles(const FewFiles&) = delete;
  FewFiles& operator=(const FewFiles&) = delete;

 private:
  rlimit before_{};
};

TEST(ManySources, AreReadWithinALimitOfOpenFiles) {
  const TemporaryFolder folder;
  constexpr std::size_t count = 1200;
  constexpr std::array compressions = {"NONE", "DEFLATE", "PACKBITS"};
  Labels names;
  for (std::size_t i = 0; i < count; ++i) {
    RasterFile file = small(static_cast<double>(i % 251));
    file.options = {std::string("COMPRESS=") + compressions[i % 3]};
    names.push_back(folder.file(std::to_string(i) + ".tif"));
    write(file, names.back());
  }
  const FewFiles few(256);  // for what is kept open, with room for what a test program has open
  const auto sources = open(names);
  ASSERT_TRUE(sources) << sources.error().message;
  ASSERT_EQ(sources->rasters.size(), count);
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (std::size_t i = t; i < 2 * count; i += 4)
        if (texel_of(*sources, i % count) != static_cast<double>(i % count % 251)) ++wrong;
    });
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace nadir::mosaic

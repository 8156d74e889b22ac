#include "nadir/pyramid/check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "mosaic/raster_file.h"
#include "nadir/base/byte_source.h"
#include "nadir/tiff/tiff_file.h"
#include "support/temporary_folder.h"

namespace nadir::pyramid {
namespace {

using mosaic::RasterFile;

class Check : public testing::Test {
 protected:
  void SetUp() override { GDALAllRegister(); }

  /// The map of a raster, of odd size so that tiles and levels end amid one another.
  std::string map_of(RasterFile file, const std::function<void(BuildOptions&)>& set = {}) const {
    file.width = 701;
    file.height = 530;
    write(file, folder_.file("source.tif"));
    BuildOptions o;
    o.sources = {folder_.file("source.tif")};
    o.output = folder_.file("map.tif");
    o.tile_size = 128;
    o.show_progress = false;
    o.force = true;
    if (set) set(o);
    const auto report = build(o);
    if (!report) throw std::runtime_error(report.error().message);
    return o.output.string();
  }

  static CheckReport checked(const std::string& map) {
    const auto report = check({.map = map, .show_progress = false});
    if (!report) throw std::runtime_error(report.error().message);
    return *report;
  }

  static void expect_sound(const std::string& map) {
    const CheckReport report = checked(map);
    EXPECT_EQ(report.fault_count, 0) << report.faults.front();
    ASSERT_GT(report.levels.size(), 3u);
    for (std::size_t k = 1; k < report.levels.size(); ++k) EXPECT_TRUE(report.levels[k].compared) << k;
  }

  /// Where the tile (col, row) of a directory lies.
  static tiff::TilePlace place(const std::string& map, std::uint32_t directory, std::uint32_t col, std::uint32_t row) {
    const auto file = tiff::TiffFile::open(LocalFile::open(map).value()).value();
    const std::vector<tiff::TileAddress> tile = {{directory, 0, col, row}};
    return file->locate(tile).front().value();
  }

  static void overwrite(const std::string& map, std::uint64_t offset, const std::string& bytes) {
    std::fstream file(map, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(offset));
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

  const test::TemporaryFolder folder_;
};

double hills(int band, int x, int y) { return 120 + 60 * std::sin(x * 0.05 + band) + 40 * std::sin(y * 0.09); }

TEST_F(Check, FindsNoFaultInWhatWasBuilt) {
  RasterFile rgb{.bands = 3, .colors = {GCI_RedBand, GCI_GreenBand, GCI_BlueBand}};
  rgb.value = hills;
  for (const Compression codec : {Compression::None, Compression::Zstd, Compression::Jpeg, Compression::Webp})
    expect_sound(map_of(rgb, [&](BuildOptions& o) { o.compression = codec; }));

  RasterFile masked = rgb;
  masked.mask = true;
  expect_sound(map_of(masked));
  RasterFile clear = rgb;
  clear.bands = 4;
  clear.colors.push_back(GCI_AlphaBand);
  clear.value = [](int band, int x, int y) { return band == 4 ? 255.0 * (x > y) : hills(band, x, y); };
  expect_sound(map_of(clear));
}

TEST_F(Check, FindsNoFaultWhateverTheRole) {
  RasterFile decibels{.type = GDT_Float32};
  decibels.value = [](int, int x, int y) { return (x * 7 + y * 3) % 23 == 0 ? std::nan("") : -20 + (x * y) % 19; };
  expect_sound(map_of(decibels, [](BuildOptions& o) { o.role = tile::Role::Radar; }));
  expect_sound(map_of(decibels, [](BuildOptions& o) { o.role = tile::Role::Elevation; }));
  expect_sound(map_of(decibels, [](BuildOptions& o) {
    o.role = tile::Role::Elevation;
    o.compression = Compression::Lerc;
    o.max_error = 0.5;
  }));
  RasterFile labels;
  labels.nodata = {0.0};
  labels.value = [](int, int x, int y) { return (x / 5 + y / 7) % 9; };
  expect_sound(map_of(labels, [](BuildOptions& o) { o.role = tile::Role::Labels; }));
}

TEST_F(Check, TellsWhichTileCannotBeDecodedAndLooksAtTheOthers) {
  const std::string map = map_of({});
  const auto damaged = place(map, 0, 2, 1);
  overwrite(map, damaged.offset, std::string(12, '\xA5'));
  const CheckReport report = checked(map);
  EXPECT_EQ(report.levels[0].damaged_tiles, 1);
  ASSERT_GE(report.fault_count, 1);
  EXPECT_NE(report.faults.front().find("level 0, tile (2, 1)"), std::string::npos) << report.faults.front();
  EXPECT_EQ(report.levels[2].different, 0);
  EXPECT_TRUE(report.levels.back().compared);
}

TEST_F(Check, TellsWhichLevelIsNotOfTheOneBefore) {
  const std::string map = map_of({}, [](BuildOptions& o) { o.compression = Compression::None; });
  // One sample, amid a tile of level 1, and of no other
  const auto tile = place(map, 1, 1, 1);
  const auto file = LocalFile::open(map).value();
  std::byte sample{};
  ASSERT_TRUE(file->read(tile.offset + 5000, {&sample, 1}));
  overwrite(map, tile.offset + 5000, std::string(1, static_cast<char>(std::to_integer<int>(sample) ^ 64)));
  const CheckReport report = checked(map);
  EXPECT_EQ(report.levels[1].different, 1);
  EXPECT_EQ(report.levels[1].greatest, 64);
  EXPECT_GT(report.levels[2].different, 0) << "made from what was there before";
  EXPECT_EQ(report.levels[3].different, 0);
}

TEST_F(Check, JudgesJpegByItsQuantization) {
  RasterFile grey;
  grey.value = hills;
  const std::string map = map_of(grey, [](BuildOptions& o) {
    o.compression = Compression::Jpeg;
    o.quality = 75;
  });
  EXPECT_EQ(checked(map).fault_count, 0);
  // An overview that is black: off by more than quality 75 can do
  {
    const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(map.c_str(), GDAL_OF_UPDATE));
    GDALRasterBand* level = dataset->GetRasterBand(1)->GetOverview(1);
    std::vector<unsigned char> black(static_cast<std::size_t>(level->GetXSize() * level->GetYSize()));
    ASSERT_EQ(level->RasterIO(GF_Write, 0, 0, level->GetXSize(), level->GetYSize(), black.data(), level->GetXSize(),
                              level->GetYSize(), GDT_Byte, 0, 0, nullptr),
              CE_None);
  }
  const CheckReport report = checked(map);
  ASSERT_GE(report.fault_count, 1);
  bool told = false;
  for (const std::string& fault : report.faults) told |= fault.find("level 2: differs") != std::string::npos;
  EXPECT_TRUE(told) << report.faults.front();
}

TEST_F(Check, SeesTilesBeyondTheFileAndOverwrittenOnes) {
  const std::string map = map_of({});
  const auto tile = place(map, 0, 0, 0);
  overwrite(map, tile.offset - 4, std::string(4, '\x01'));  // its leader
  const CheckReport led = checked(map);
  EXPECT_EQ(led.fault_count, 1);
  EXPECT_NE(led.faults.front().find("something was overwritten"), std::string::npos) << led.faults.front();

  const std::string other = map_of({});
  std::filesystem::resize_file(other, place(other, 0, 3, 2).offset + 1);
  const CheckReport cut = checked(other);
  EXPECT_GT(cut.levels[0].damaged_tiles, 0);
  EXPECT_GT(cut.fault_count, 0);
}

TEST_F(Check, MapsOfOthersAreDecodedAndTheirStructureIsLookedAt) {
  RasterFile file{.width = 1500, .height = 1100, .driver = "COG", .options = {"BLOCKSIZE=128"}};
  write(file, folder_.file("other.tif"));
  const CheckReport report = checked(folder_.file("other.tif"));
  EXPECT_EQ(report.fault_count, 0) << report.faults.front();
  EXPECT_TRUE(report.cloud_optimized);
  EXPECT_EQ(report.levels[0].tiles, 12 * 9);
  EXPECT_FALSE(report.levels[1].compared);
}

TEST_F(Check, FindsTheSameWhateverTheThreads) {
  const std::string map = map_of({}, [](BuildOptions& o) { o.compression = Compression::None; });
  for (const std::uint32_t row : {0u, 3u, 1u}) overwrite(map, place(map, 0, row, row).offset + 100, "damage");
  const auto one = check({.map = map, .threads = 1, .show_progress = false}).value();
  const auto four = check({.map = map, .threads = 4, .show_progress = false}).value();
  EXPECT_GT(one.fault_count, 0);
  EXPECT_EQ(one.faults, four.faults);
  EXPECT_EQ(one.levels[1].rms, four.levels[1].rms);
}

}  // namespace
}  // namespace nadir::pyramid

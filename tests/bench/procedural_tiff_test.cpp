#include "nadir/bench/procedural_tiff.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <cstring>
#include <fstream>
#include <random>
#include <thread>

#include "support/temporary_folder.h"

namespace nadir::bench {
namespace {

struct CloseDataset {
  void operator()(GDALDataset* dataset) const noexcept { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<GDALDataset, CloseDataset>;

Dataset open_with_gdal(const std::string& path) {
  GDALAllRegister();
  return Dataset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
}

/// Texels of a window of one level that GDAL reads otherwise than the rule has them.
int wrong_samples(GDALRasterBand& band, const MapRule& rule, int level, int index, int x, int y, int w, int h) {
  std::vector<double> got(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  if (band.RasterIO(GF_Read, x, y, w, h, got.data(), w, h, GDT_Float64, 0, 0, nullptr) != CE_None) return w * h;
  int wrong = 0;
  for (int row = 0; row < h; ++row)
    for (int column = 0; column < w; ++column)
      wrong += got[static_cast<std::size_t>(row) * static_cast<std::size_t>(w) + static_cast<std::size_t>(column)] !=
               rule_sample(rule.type, level, index, x + column, y + row);
  return wrong;
}

std::vector<std::byte> read(const ByteSource& source, std::uint64_t offset, std::size_t size) {
  std::vector<std::byte> bytes(size, std::byte{0xEE});
  EXPECT_TRUE(source.read(offset, bytes));
  return bytes;
}

template <class T>
T value_at(const ByteSource& source, std::uint64_t offset) {
  const auto bytes = read(source, offset, sizeof(T));
  T value;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

TEST(RepeatedContent, IsReadByGdalFromAFileThatHoldsItOnce) {
  constexpr int period = 64, tile = 16, side = 256;
  std::mt19937 engine(3);
  std::vector<float> texels(period * period * 3);
  for (float& texel : texels) texel = static_cast<float>(engine() % 256);
  MapRule rule{.width = side, .height = side, .tile_size = tile, .texture = true};
  rule.content = std::make_shared<const RepeatedContent>(texels, period, 3, true);
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "repeated.tif";
  ASSERT_TRUE(write_map(path, rule));
  EXPECT_LT(std::filesystem::file_size(path), side * side * 3u / 4) << "equal tiles lie there once";

  const Dataset dataset = open_with_gdal(path);
  ASSERT_TRUE(dataset);
  GDALRasterBand& band = *dataset->GetRasterBand(2);
  ASSERT_EQ(band.GetOverviewCount(), 4);
  for (int level = 0; level <= 4; ++level) {
    GDALRasterBand& at_level = level == 0 ? band : *band.GetOverview(level - 1);
    const int n = side >> level;
    std::vector<float> got(static_cast<std::size_t>(n * n));
    ASSERT_EQ(at_level.RasterIO(GF_Read, 0, 0, n, n, got.data(), n, n, GDT_Float32, 0, 0, nullptr), CE_None);
    int wrong = 0;
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) wrong += got[static_cast<std::size_t>(y * n + x)] != rule.content->at(level, 1, x, y);
    EXPECT_EQ(wrong, 0) << "level " << level;
  }
  // The second level by its definition
  const auto texel = [&](int x, int y) { return texels[static_cast<std::size_t>((y * period + x) * 3)]; };
  EXPECT_EQ(rule.content->at(1, 0, 2, 1 + period / 2),
            std::floor((texel(4, 2) + texel(5, 2) + texel(4, 3) + texel(5, 3)) / 4 + 0.5f));
}

TEST(RepeatedContent, MustFitTiles) {
  MapRule rule{.width = 256, .height = 256, .tile_size = 48};
  rule.content = std::make_shared<const RepeatedContent>(std::vector<float>(64 * 64 * 3), 64, 3, true);
  const auto refused = ProceduralTiff::make("m", rule);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("repeats after 64 texels"), std::string::npos);
}

TEST(Rule, ValuesAreTheSameOnEveryMachine) {
  // As the formula gives in whole numbers of any size: a change makes results of other versions incomparable.
  EXPECT_EQ(rule_sample(SampleType::u16, 0, 0, 0, 0), 31505);
  EXPECT_EQ(rule_sample(SampleType::u16, 3, 2, 1'000'000'007, 123), 39855);
}

TEST(Rule, NeighboursDifferByTheTextureAndFarPlacesByHills) {
  std::vector<std::uint16_t> row(1 << 14);
  rule_row(0, 0, 0, 77, row.size(), row.data());
  int largest_step = 0;
  for (std::size_t i = 1; i < row.size(); ++i) largest_step = std::max(largest_step, std::abs(row[i] - row[i - 1]));
  // The texture is at most 8191. Of the five hills, the one of 32 texels rises by 65535 / 32 a texel, the one of 1024
  // by 64, others by less than 3; their mean times 7/8 by at most 371.
  EXPECT_LE(largest_step, 8191 + 371 + 1);
  EXPECT_GE(largest_step, 8191 / 2) << "there is a texture";
  const auto [least, most] = std::minmax_element(row.begin(), row.end());
  EXPECT_GT(*most - *least, 2 * largest_step) << "there are hills";
}

TEST(Rule, AWindowOfARowIsPartOfTheRow) {
  std::vector<std::uint16_t> row(500), window(100);
  rule_row(2, 1, 1000, 5, row.size(), row.data());
  rule_row(2, 1, 1123, 5, window.size(), window.data());
  EXPECT_TRUE(std::equal(window.begin(), window.end(), row.begin() + 123));
}

struct Kind {
  const char* name;
  MapRule rule;
  friend void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }
};

class ProceduralFile : public testing::TestWithParam<Kind> {};

TEST_P(ProceduralFile, IsWhatGdalReads) {
  const MapRule rule = GetParam().rule;
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_map(folder.file("m.tif"), rule));
  EXPECT_EQ(write_map(folder.file("m.tif"), rule).error().kind, Error::Kind::Exists);
  const Dataset dataset = open_with_gdal(folder.file("m.tif"));
  ASSERT_TRUE(dataset);
  EXPECT_EQ(dataset->GetRasterXSize(), rule.width);
  EXPECT_EQ(dataset->GetRasterYSize(), rule.height);
  ASSERT_EQ(dataset->GetRasterCount(), rule.bands);
  ASSERT_TRUE(dataset->GetSpatialRef());
  EXPECT_STREQ(dataset->GetSpatialRef()->GetAuthorityCode(nullptr), std::to_string(rule.epsg).c_str());
  std::array<double, 6> transform{};
  ASSERT_EQ(dataset->GetGeoTransform(transform.data()), CE_None);
  EXPECT_EQ(transform, (std::array<double, 6>{rule.west, rule.texel, 0, rule.north, 0, -rule.texel}));

  for (int b = 0; b < rule.bands; ++b) {
    GDALRasterBand* band = dataset->GetRasterBand(b + 1);
    int has_nodata = 0;
    const double nodata = band->GetNoDataValue(&has_nodata);
    EXPECT_EQ(has_nodata != 0, rule.nodata.has_value());
    if (rule.nodata) {
      EXPECT_EQ(nodata, *rule.nodata);
    }
    int tile_width = 0, tile_height = 0;
    band->GetBlockSize(&tile_width, &tile_height);
    EXPECT_EQ(tile_width, rule.tile_size);
    const auto tiff = ProceduralTiff::make("m", rule).value();
    ASSERT_EQ(band->GetOverviewCount(), tiff->levels() - 1);
    for (int k = 0; k < tiff->levels(); ++k) {
      GDALRasterBand* level = k == 0 ? band : band->GetOverview(k - 1);
      const int w = level->GetXSize(), h = level->GetYSize();
      ASSERT_EQ(w, std::max<std::int64_t>(rule.width >> k, 1));
      ASSERT_EQ(h, std::max<std::int64_t>(rule.height >> k, 1));
      // Windows across the middle and into the last corner
      EXPECT_EQ(wrong_samples(*level, rule, k, b, w / 3, h / 3, std::clamp(w / 3, 1, 200), std::clamp(h / 3, 1, 200)),
                0)
          << "level " << k;
      EXPECT_EQ(wrong_samples(*level, rule, k, b, w - std::min(w, 300), h - std::min(h, 20), std::min(w, 300),
                              std::min(h, 20)),
                0)
          << "level " << k;
    }
  }
}

TEST_P(ProceduralFile, GivesAnyRangeOfTheWrittenFile) {
  const MapRule rule = GetParam().rule;
  const test::TemporaryFolder folder;
  const std::string path = folder.file("m.tif");
  ASSERT_TRUE(write_map(path, rule));
  const auto file = LocalFile::open(path).value();
  const auto tiff = ProceduralTiff::make("m", rule).value();  // another one: it knows no byte counts yet
  ASSERT_EQ(file->size(), tiff->size());
  std::mt19937_64 random(1);
  for (int i = 0; i < 300; ++i) {
    // A third each in the directories and indexes, across borders of tiles, and anywhere
    const std::uint64_t from = i % 3 == 0   ? random() % 8192
                               : i % 3 == 1 ? random() % (tiff->size() >> 12) << 12
                                            : random() % tiff->size();
    const std::uint64_t offset = i % 3 == 1 && from > 50 ? from - 50 : from;
    const std::size_t size = std::min<std::uint64_t>(random() % (i % 3 == 1 ? 100 : 5000), tiff->size() - offset);
    ASSERT_EQ(read(*tiff, offset, size), read(*file, offset, size)) << offset << " + " << size;
  }
  std::byte beyond[2];
  EXPECT_TRUE(tiff->read(tiff->size() - 2, beyond));
  EXPECT_EQ(tiff->read(tiff->size() - 1, beyond).error().kind, Error::Kind::Io);
  EXPECT_EQ(tiff->read(~std::uint64_t{0}, beyond).error().kind, Error::Kind::Io);
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, ProceduralFile,
    testing::Values(
        Kind{"none_u8", {.width = 4096, .height = 4096}},
        Kind{"deflate_u8", {.width = 4096, .height = 4096, .codec = Codec::deflate}},
        Kind{"zstd_u8", {.width = 4096, .height = 4096, .codec = Codec::zstd}},
        Kind{"odd_u16",
             {.width = 1501,
              .height = 701,
              .bands = 5,
              .type = SampleType::u16,
              .codec = Codec::deflate,
              .tile_size = 128,
              .epsg = 4326,
              .west = -0.75,
              .north = 38,
              .texel = 0x1p-16,
              .nodata = 7}},
        Kind{"narrow_f32",
             {.width = 3000,
              .height = 3,
              .bands = 1,
              .type = SampleType::f32,
              .codec = Codec::zstd,
              .tile_size = 512,
              .epsg = 3857,
              .nodata = -0.5}},
        Kind{"one_tile", {.width = 40, .height = 50, .bands = 1, .codec = Codec::zstd}},
        Kind{"filled_zstd", {.width = 1000, .height = 1000, .codec = Codec::zstd, .exact_byte_counts = false}},
        Kind{"filled_deflate", {.width = 1000, .height = 1000, .codec = Codec::deflate, .exact_byte_counts = false}}),
    [](const auto& kind) { return std::string(kind.param.name); });

TEST(ProceduralTiff, LargestMapsNeedNoDisk) {
  constexpr std::int64_t side = std::int64_t{1} << 30;
  const auto tiff = ProceduralTiff::make("huge", {.width = side, .height = side, .codec = Codec::zstd}).value();
  EXPECT_EQ(tiff->levels(), 23) << "2^30 to 2^8";
  EXPECT_GT(tiff->size(), std::uint64_t{1} << 61);
  EXPECT_LT(tiff->size(), std::uint64_t{1} << 63);
  // The first directory starts at 16; tags 324 and 325 are its 10th and 11th
  ASSERT_EQ(value_at<std::uint16_t>(*tiff, 16 + 8 + 9 * 20), 324);
  const std::uint64_t tiles = value_at<std::uint64_t>(*tiff, 16 + 8 + 9 * 20 + 4);
  EXPECT_EQ(tiles, std::uint64_t{1} << 44);
  const auto offsets = value_at<std::uint64_t>(*tiff, 16 + 8 + 9 * 20 + 12),
             counts = value_at<std::uint64_t>(*tiff, 16 + 8 + 10 * 20 + 12);
  const std::uint64_t last = value_at<std::uint64_t>(*tiff, offsets + 8 * (tiles - 1)),
                      count = value_at<std::uint64_t>(*tiff, counts + 8 * (tiles - 1));
  ASSERT_LE(last + count, tiff->size());
  EXPECT_GT(count, 1000u);
  EXPECT_EQ(value_at<std::uint32_t>(*tiff, last), 0xFD2FB528u) << "the magic number of a Zstandard frame";
}

TEST(ProceduralTiff, GdalReadsTheLastTexelsOfAMapOfSixtyGigabytes) {
  const MapRule rule{.width = 131072, .height = 131072};
  const auto tiff = ProceduralTiff::make("large", rule).value();
  EXPECT_GT(tiff->size(), std::uint64_t{60} << 30);
  // A file of one hole but for what GDAL needs: directories and indexes, which for 4/3 * 512 * 512 tiles of two numbers
  // of 8 bytes end before 8 MiB, and the last tile, which is the last in the file
  const test::TemporaryFolder folder;
  const std::string path = folder.file("sparse.tif");
  const auto begin = read(*tiff, 0, 8 << 20);
  const std::uint64_t tile_bytes = 256 * 256 * 3;
  const auto end = read(*tiff, tiff->size() - tile_bytes, tile_bytes);
  {
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(begin.data()), static_cast<std::streamsize>(begin.size()));
    file.seekp(static_cast<std::streamoff>(tiff->size() - tile_bytes));
    file.write(reinterpret_cast<const char*>(end.data()), static_cast<std::streamsize>(end.size()));
    if (!file.flush()) GTEST_SKIP() << "this file system has no files of 64 GB with holes";
  }
  const Dataset dataset = open_with_gdal(path);
  ASSERT_TRUE(dataset);
  for (int b = 0; b < 3; ++b)
    EXPECT_EQ(wrong_samples(*dataset->GetRasterBand(b + 1), rule, 0, b, 131072 - 256, 131072 - 256, 256, 256), 0);
}

TEST(ProceduralTiff, ThreadsReadTheSameBytes) {
  const MapRule rule{.width = 2048, .height = 2048, .codec = Codec::zstd, .tile_size = 64};  // more tiles than are kept
  const auto tiff = ProceduralTiff::make("m", rule).value();
  const auto all = read(*tiff, 0, tiff->size());
  const auto fresh = ProceduralTiff::make("m", rule).value();
  std::array<std::vector<std::byte>, 3> parts;
  {
    std::vector<std::jthread> threads;
    for (auto& part : parts)
      threads.emplace_back([&] {
        part.resize(fresh->size());
        if (!fresh->read(0, part)) part.clear();
      });
  }
  for (const auto& part : parts) EXPECT_TRUE(part == all);
}

TEST(ProceduralTiff, RefusesWhatItCannotBe) {
  const auto message = [](const MapRule& rule) {
    const auto tiff = ProceduralTiff::make("m", rule);
    return tiff ? "no error" : tiff.error().message;
  };
  EXPECT_NE(message({.width = 0, .height = 5}).find("0 x 5 texels"), std::string::npos);
  EXPECT_NE(message({.width = 5, .height = (std::int64_t{1} << 30) + 1}).find("2^30"), std::string::npos);
  EXPECT_NE(message({.width = 5, .height = 5, .bands = 0}).find("0 bands"), std::string::npos);
  EXPECT_NE(message({.width = 5, .height = 5, .tile_size = 100}).find("tiles of 100"), std::string::npos);
  EXPECT_NE(message({.width = 5, .height = 5, .epsg = 2056}).find("EPSG:2056"), std::string::npos);
  EXPECT_NE(message({.width = 1 << 30, .height = 1 << 30, .type = SampleType::f32}).find("2^63"), std::string::npos);
}

}  // namespace
}  // namespace nadir::bench

#include "nadir/pyramid/build.h"

#include <fmt/format.h>
#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <random>

#include "nadir/tile/map_description.h"
#include "support/small_disk.h"
#include "support/temporary_folder.h"

namespace nadir::pyramid {
namespace {
namespace fs = std::filesystem;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// What a test raster is like; the rest is up to the test.
struct Shape {
  int width = 256, height = 256, bands = 1;
  GDALDataType type = GDT_Byte;
  int epsg = 32630;  // 0: none
  double left = 500000, top = 4200000, texel = 10;
  const char* driver = "GTiff";
};
using Value = std::function<double(int x, int y, int band)>;

std::vector<double> read_level(const fs::path& path, int level, int band);

class Build : public testing::Test {
 protected:
  void SetUp() override { GDALAllRegister(); }

  fs::path path(const std::string& name) const { return folder_.path() / name; }

  /// Writes a raster, first to memory since PNG is only written as a copy; `finish` may set what else it should have.
  std::string raster(const std::string& name, const Shape& s, const Value& value,
                     const std::function<void(GDALDataset&)>& finish = {}) const {
    std::unique_ptr<GDALDataset> memory{driver("MEM").Create("", s.width, s.height, s.bands, s.type, nullptr)};
    std::array<double, 6> g = {s.left, s.texel, 0, s.top, 0, -s.texel};
    if (s.epsg != 0) {
      OGRSpatialReference crs;
      crs.importFromEPSG(s.epsg);
      memory->SetSpatialRef(&crs);
      memory->SetGeoTransform(g.data());
    }
    std::vector<double> row(static_cast<std::size_t>(s.width));
    for (int b = 1; b <= s.bands; ++b) {
      for (int y = 0; y < s.height; ++y) {
        for (int x = 0; x < s.width; ++x) row[static_cast<std::size_t>(x)] = value(x, y, b);
        EXPECT_EQ(memory->GetRasterBand(b)->RasterIO(GF_Write, 0, y, s.width, 1, row.data(), s.width, 1, GDT_Float64, 0,
                                                     0, nullptr),
                  CE_None);
      }
      if (s.bands >= 3 && s.type == GDT_Byte) {
        static constexpr std::array colors = {GCI_RedBand, GCI_GreenBand, GCI_BlueBand, GCI_AlphaBand};
        memory->GetRasterBand(b)->SetColorInterpretation(colors[static_cast<std::size_t>(b) - 1]);
      }
    }
    if (finish) finish(*memory);
    const fs::path file = path(name);
    fs::create_directories(file.parent_path());
    std::unique_ptr<GDALDataset> written{
        driver(s.driver).CreateCopy(file.c_str(), memory.get(), FALSE, nullptr, nullptr, nullptr)};
    EXPECT_TRUE(written);
    return file.string();
  }

  BuildOptions options(std::vector<std::string> sources, const std::string& output = "map.tif") const {
    BuildOptions o;
    o.sources = std::move(sources);
    o.output = path(output);
    o.tile_size = 128;
    o.show_progress = false;
    return o;
  }

  /// The error's message; the map must not be there, nor anything temporary.
  std::string failure(const BuildOptions& o) const {
    const auto count = [&] { return std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()); };
    const auto before = count();
    const auto report = build(o);
    EXPECT_FALSE(report);
    EXPECT_EQ(count(), before) << "something was left behind";
    return report ? "" : report.error().message;
  }

  static GDALDriver& driver(const char* name) { return *GetGDALDriverManager()->GetDriverByName(name); }

  test::TemporaryFolder folder_;
};

std::unique_ptr<GDALDataset> open(const fs::path& path) {
  return std::unique_ptr<GDALDataset>{static_cast<GDALDataset*>(GDALOpen(path.c_str(), GA_ReadOnly))};
}

std::vector<double> read_band(GDALRasterBand& band) {
  std::vector<double> samples(static_cast<std::size_t>(band.GetXSize()) * static_cast<std::size_t>(band.GetYSize()));
  EXPECT_EQ(band.RasterIO(GF_Read, 0, 0, band.GetXSize(), band.GetYSize(), samples.data(), band.GetXSize(),
                          band.GetYSize(), GDT_Float64, 0, 0, nullptr),
            CE_None);
  return samples;
}

std::vector<double> read_level(const fs::path& path, int level, int band) {
  auto map = open(path);
  GDALRasterBand* full = map->GetRasterBand(band);
  return read_band(level == 0 ? *full : *full->GetOverview(level - 1));
}

std::vector<double> read_mask(const fs::path& path, int level) {
  auto map = open(path);
  GDALRasterBand* full = map->GetRasterBand(1);
  return read_band(*(level == 0 ? full : full->GetOverview(level - 1))->GetMaskBand());
}

/// Every 2x2 block holds `block`: the right mean is the same all over level 1.
Value blocks(std::array<double, 4> block) {
  return [block](int x, int y, int) { return block[static_cast<std::size_t>(y % 2 * 2 + x % 2)]; };
}

void expect_all(const std::vector<double>& samples, double expected, double tolerance) {
  ASSERT_FALSE(samples.empty());
  for (const double sample : samples) ASSERT_NEAR(sample, expected, tolerance);
}

TEST_F(Build, RadarInDecibelIsAveragedInPower) {
  // Powers 1, 0.1, 0.1 and 0.01 have the mean 0.3025; the mean of the decibels would be -10.
  const auto source = raster("s1.tif", {.type = GDT_Float32}, blocks({0, -10, -10, -20}));
  auto o = options({source});
  o.role = tile::Role::Radar;
  const auto report = build(o);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->reduction, "box of power");
  ASSERT_EQ(report->levels.size(), 3u);
  const double expected = 10 * std::log10(0.3025);  // -5.19: floats there are 2^-21 apart
  for (const int level : {1, 2}) expect_all(read_level(o.output, level, 1), expected, 0x1p-22);
}

TEST_F(Build, RadarSaidToBeLinearIsAveragedAsStored) {
  const auto source = raster("s1.tif", {.type = GDT_Float32}, blocks({0, -10, -10, -20}));
  auto o = options({source});
  o.role = tile::Role::Radar;
  o.radar_scale = tile::RadarScale::Linear;
  ASSERT_TRUE(build(o));
  expect_all(read_level(o.output, 1, 1), -10, 0);
}

TEST_F(Build, RadarInScaledIntegersIsAveragedInThePowerTheyStandFor) {
  // Hundredths of a decibel above -30: the same powers as above give -5.1927 dB, stored 2480.73, rounded 2481.
  const auto source = raster("s1.tif", {.type = GDT_Int16}, blocks({3000, 2000, 2000, 1000}), [](GDALDataset& d) {
    d.GetRasterBand(1)->SetScale(0.01);
    d.GetRasterBand(1)->SetOffset(-30);
  });
  auto o = options({source});
  o.role = tile::Role::Radar;
  o.radar_scale = tile::RadarScale::Decibel;
  ASSERT_TRUE(build(o));
  expect_all(read_level(o.output, 1, 1), 2481, 0);
}

TEST_F(Build, RadarExtremesStayFinite) {
  // 10^(30000 / 10) overflows a double and 10^(-9999 / 10) vanishes in one.
  const auto low = raster("low.tif", {.type = GDT_Float32}, [](int, int, int) { return -9999; });
  const auto high = raster("high.tif", {.type = GDT_Float32}, [](int, int, int) { return 30000; });
  for (const auto& [source, value] : {std::pair(low, -9999.0), std::pair(high, 30000.0)}) {
    auto o = options({source}, fmt::format("{}.tif", value));
    o.role = tile::Role::Radar;
    ASSERT_TRUE(build(o));
    expect_all(read_level(o.output, 2, 1), value, 0);
  }
}

TEST_F(Build, NanAndNodataHaveNoPartInAMeanOfPower) {
  for (const double nodata : {nan, -9999.0}) {
    const auto source = raster(fmt::format("s1_{}.tif", nodata), {.type = GDT_Float32}, blocks({0, nan, -10, nodata}),
                               [&](GDALDataset& d) { d.GetRasterBand(1)->SetNoDataValue(nodata); });
    auto o = options({source}, fmt::format("map_{}.tif", nodata));
    o.role = tile::Role::Radar;
    ASSERT_TRUE(build(o));
    expect_all(read_level(o.output, 1, 1), 10 * std::log10(0.55), 0x1p-23);  // -2.6: floats there are 2^-22 apart
  }
}

TEST_F(Build, WhereNothingIsValidACoarserLevelHasNodata) {
  const auto hole = [](int x, int, int) { return x < 128 ? -9999.0 : 5.0; };
  const auto source =
      raster("dsm.tif", {.type = GDT_Float32}, hole, [](GDALDataset& d) { d.GetRasterBand(1)->SetNoDataValue(-9999); });
  auto o = options({source});
  o.role = tile::Role::Elevation;
  ASSERT_TRUE(build(o));
  const auto level = read_level(o.output, 2, 1);
  for (std::size_t i = 0; i < level.size(); ++i) ASSERT_EQ(level[i], i % 64 < 32 ? -9999 : 5);
}

TEST_F(Build, NanDoesNotSpreadInElevation) {
  const auto source = raster("dsm.tif", {.type = GDT_Float32}, blocks({1, 2, nan, 6}));
  auto o = options({source});
  o.role = tile::Role::Elevation;
  ASSERT_TRUE(build(o));
  expect_all(read_level(o.output, 1, 1), 3, 0);
}

TEST_F(Build, OpticalMeansLeaveOutNodata) {
  const auto source =
      raster("eo.tif", {}, blocks({100, 0, 0, 110}), [](GDALDataset& d) { d.GetRasterBand(1)->SetNoDataValue(0); });
  auto o = options({source});
  ASSERT_TRUE(build(o));
  expect_all(read_level(o.output, 1, 1), 105, 0);
}

TEST_F(Build, OpticalMeansLeaveOutWhatIsTransparent) {
  const auto source = raster("eo.tif", {.bands = 4}, [](int x, int y, int band) {
    const bool seen = (x + y) % 2 == 0;
    return band == 4 ? (seen ? 255 : 0) : (seen ? 80 : 200);
  });
  ASSERT_TRUE(build(options({source})));
  expect_all(read_level(path("map.tif"), 1, 2), 80, 0);
}

TEST_F(Build, LabelsAreNeverBlended) {
  const auto source = raster("classes.tif", {.width = 301, .height = 233},
                             [](int x, int y, int) { return (x / 7 + y / 5) % 2 == 0 ? 10 : 200; });
  auto o = options({source});
  o.role = tile::Role::Labels;
  const auto report = build(o);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->reduction, "mode");
  for (std::size_t level = 1; level < report->levels.size(); ++level)
    for (const double label : read_level(o.output, static_cast<int>(level), 1))
      ASSERT_TRUE(label == 10 || label == 200) << label;
}

TEST_F(Build, TheCommonerLabelWins) {
  auto o = options({raster("classes.tif", {}, blocks({7, 200, 7, 7}))});
  o.role = tile::Role::Labels;
  ASSERT_TRUE(build(o));
  expect_all(read_level(o.output, 1, 1), 7, 0);
}

TEST_F(Build, AnOddSizeDoesNotMoveTheGround) {
  // Seen as a continuous slope, sample i of n should hold the value in its middle, at (i + 0.5) / n of the way.
  // A mean over r finer samples, 1 < r <= 2, takes fractions t of those at its two ends, whose centres lie (1 - t) / 2
  // off those of the fractions: t (1 - t) / (2 r) <= 1 / (8 r) finer samples, one end to the left and one to the right.
  // Each level adds its own. Plain 2 x 2 blocks would be off by 3 at the far edge of level 1 and by 9 at that of
  // level 3.
  constexpr int width = 277, height = 131;
  const auto source = raster("slope.tif", {.width = width, .height = height, .type = GDT_Float64},
                             [](int x, int y, int) { return 3 * (x + 0.5) + 5 * (y + 0.5); });
  auto o = options({source});
  o.role = tile::Role::Elevation;
  const auto report = build(o);
  ASSERT_TRUE(report);
  ASSERT_EQ(report->levels.size(), 4u);
  double bound = 0;
  for (std::size_t k = 1; k < report->levels.size(); ++k) {
    const auto size = report->levels[k], finer = report->levels[k - 1];
    const auto off = [](double full, double fine, double coarse) {
      return full / fine / (8 * fine / coarse);
    };  // in level-0 samples
    bound += 3 * off(width, finer.width, size.width) + 5 * off(height, finer.height, size.height);
    const auto level = read_level(o.output, static_cast<int>(k), 1);
    double worst = 0;
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x)
        worst =
            std::max(worst, std::abs(level[static_cast<std::size_t>(y * size.width + x)] -
                                     3.0 * width * (x + 0.5) / size.width - 5.0 * height * (y + 0.5) / size.height));
    EXPECT_LE(worst, bound) << "level " << k;
    EXPECT_GT(worst, 0) << "these sizes no longer have fractions";
  }
}

TEST_F(Build, LevelsGoOnUntilTheyAreSmall) {
  const auto report =
      build(options({raster("long.tif", {.width = 3000, .height = 70}, [](int x, int, int) { return x % 251; })}));
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_LE(report->levels.back().width, 64);
  EXPECT_GE(report->levels.back().height, 1);
  EXPECT_GT(report->levels[report->levels.size() - 2].width, 64);
}

TEST_F(Build, LosslessCodecsKeepEverySample) {
  std::mt19937 random(1);
  std::vector<int> noise(256 * 256 * 3);
  for (int& n : noise) n = static_cast<int>(random() % 256);
  const auto value = [&](int x, int y, int b) { return noise[static_cast<std::size_t>((y * 256 + x) * 3 + b - 1)]; };
  const auto source = raster("eo.tif", {.bands = 3}, value);
  for (const auto codec : {Compression::None, Compression::Deflate, Compression::Zstd, Compression::Lzw,
                           Compression::Lerc, Compression::Webp}) {
    auto o = options({source}, fmt::format("{}.tif", to_string(codec)));
    o.compression = codec;
    if (codec == Compression::Webp) o.quality = 100;
    const auto report = build(o);
    ASSERT_TRUE(report) << report.error().message;
    for (const int b : {1, 2, 3}) EXPECT_EQ(read_level(o.output, 0, b), read_level(source, 0, b)) << to_string(codec);
  }
}

TEST_F(Build, JpegTurnsAlphaIntoAMask) {
  // A mask knows 0 and 255 only: what is less than half opaque is off.
  const auto source = raster("eo.tif", {.bands = 4}, [](int x, int, int band) {
    return band < 4 ? 90 : x < 64 ? 0 : x < 128 ? 127 : x < 192 ? 128 : 255;
  });
  auto o = options({source});
  o.compression = Compression::Jpeg;
  const auto report = build(o);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->bands, 3);
  const auto description = tile::describe(o.output.string());
  ASSERT_TRUE(description);
  EXPECT_EQ(description->validity, tile::ValiditySource::Mask);
  const auto mask = read_mask(o.output, 0);
  for (std::size_t i = 0; i < mask.size(); ++i) ASSERT_EQ(mask[i], i % 256 < 128 ? 0 : 255);
}

TEST_F(Build, AMaskBandAndItsLevelsAreKept) {
  const auto source = raster(
      "masked.tif", {.type = GDT_Float32}, [](int x, int, int) { return x < 128 ? 1e30 : 4; },
      [](GDALDataset& d) {
        ASSERT_EQ(d.CreateMaskBand(GMF_PER_DATASET), CE_None);
        std::vector<std::uint8_t> mask(256 * 256);
        for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = i % 256 < 129 ? 0 : 255;
        ASSERT_EQ(d.GetRasterBand(1)->GetMaskBand()->RasterIO(GF_Write, 0, 0, 256, 256, mask.data(), 256, 256, GDT_Byte,
                                                              0, 0, nullptr),
                  CE_None);
      });
  ASSERT_TRUE(build(options({source})));
  const auto mask = read_mask(path("map.tif"), 1), samples = read_level(path("map.tif"), 1, 1);
  for (std::size_t i = 0; i < mask.size(); ++i) {
    ASSERT_EQ(mask[i], i % 128 < 64 ? 0 : 255);
    if (mask[i] > 0) {
      ASSERT_EQ(samples[i], 4);
    }
  }
}

TEST_F(Build, TilesOfAFolderLieWhereTheirNumbersSay) {
  // Zoom 3, columns 4 and 5, rows 2 and 3: a coloured tile, one with alpha, a palette, and one missing.
  const Shape tile{.bands = 3, .epsg = 0, .driver = "PNG"};
  Shape with_alpha = tile, palette = tile;
  with_alpha.bands = 4;
  palette.bands = 1;
  raster("tiles/3/4/2.png", tile, [](int x, int, int b) { return b == 1 ? x : 10 * b; });
  raster("tiles/3/5/2.png", with_alpha, [](int x, int y, int b) { return b == 4 ? x : y; });
  raster(
      "tiles/3/4/3.png", palette, [](int, int, int) { return 1; },
      [](GDALDataset& d) {
        GDALColorTable colors;
        const GDALColorEntry first{1, 1, 1, 255}, second{50, 60, 70, 255};
        colors.SetColorEntry(0, &first);
        colors.SetColorEntry(1, &second);
        d.GetRasterBand(1)->SetColorInterpretation(GCI_PaletteIndex);
        d.GetRasterBand(1)->SetColorTable(&colors);
      });
  raster("tiles/2/2/1.png", tile, [](int, int, int) { return 0; });  // a coarser zoom, not taken

  const auto report = build(options({path("tiles").string()}));
  ASSERT_TRUE(report) << report.error().message;
  auto map = open(path("map.tif"));
  ASSERT_EQ(map->GetRasterXSize(), 512);
  ASSERT_EQ(map->GetRasterYSize(), 512);
  const auto red = read_band(*map->GetRasterBand(1)), green = read_band(*map->GetRasterBand(2)),
             alpha = read_band(*map->GetRasterBand(4));
  for (std::size_t y = 0; y < 512; ++y) {
    for (std::size_t x = 0; x < 512; ++x) {
      const std::size_t i = y * 512 + x;
      const bool right = x >= 256, lower = y >= 256;
      ASSERT_EQ(alpha[i], !right ? 255 : lower ? 0 : static_cast<double>(x - 256)) << x << ", " << y;
      ASSERT_EQ(red[i], lower ? (right ? 0 : 50) : static_cast<double>(right ? y : x));
      ASSERT_EQ(green[i], lower ? (right ? 0 : 60) : right ? static_cast<double>(y) : 20);
    }
  }
  // Column 4 of 8 begins at longitude 0, row 2 half way from the top, at half the height of the northern half.
  double g[6];
  ASSERT_EQ(map->GetGeoTransform(g), CE_None);
  const double half_world = 20037508.342789244;  // pi times 6378137 m
  EXPECT_NEAR(g[0], 0, 1e-6);
  EXPECT_NEAR(g[3], half_world / 2, 1e-6);
  EXPECT_NEAR(g[1], half_world / 4 / 256, 1e-9);
  EXPECT_STREQ(map->GetSpatialRef()->GetAuthorityCode(nullptr), "3857");

  auto coarser = options({path("tiles").string()}, "coarser.tif");
  coarser.zoom = 2;
  EXPECT_TRUE(build(coarser));
  coarser.output = path("none.tif");
  coarser.zoom = 9;
  EXPECT_NE(failure(coarser).find("none at zoom 9"), std::string::npos);
}

TEST_F(Build, LaterSourcesLieOnTopAndTransparencyShowsThrough) {
  const auto lower = raster("lower.tif", {.bands = 4}, [](int, int, int b) { return b == 4 ? 255 : 10; });
  // 100 texels east and 50 south; its upper half is transparent.
  const auto upper = raster("upper.tif", {.bands = 4, .left = 501000, .top = 4199500},
                            [](int, int y, int b) { return b == 4 ? (y < 128 ? 0 : 255) : 20; });
  ASSERT_TRUE(build(options({lower, upper})));
  auto map = open(path("map.tif"));
  ASSERT_EQ(map->GetRasterXSize(), 356);
  ASSERT_EQ(map->GetRasterYSize(), 306);
  const auto red = read_band(*map->GetRasterBand(1)), alpha = read_band(*map->GetRasterBand(4));
  for (int y = 0; y < 306; ++y) {
    for (int x = 0; x < 356; ++x) {
      const bool above = x >= 100 && y >= 50 + 128, below = x < 256 && y < 256;
      const auto i = static_cast<std::size_t>(y * 356 + x);
      ASSERT_EQ(alpha[i], above || below ? 255 : 0) << x << ", " << y;
      if (alpha[i] > 0) {
        ASSERT_EQ(red[i], above ? 20 : 10) << x << ", " << y;
      }
    }
  }
}

TEST_F(Build, NodataOfALaterSourceShowsWhatLiesBelow) {
  const auto set_nodata = [](GDALDataset& d) { d.GetRasterBand(1)->SetNoDataValue(0); };
  const auto lower = raster(
      "lower.tif", {}, [](int, int, int) { return 10; }, set_nodata);
  const auto upper = raster(
      "upper.tif", {}, [](int x, int, int) { return x < 128 ? 0 : 20; }, set_nodata);
  ASSERT_TRUE(build(options({lower, upper})));
  const auto samples = read_level(path("map.tif"), 0, 1);
  for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_EQ(samples[i], i % 256 < 128 ? 10 : 20);
}

TEST_F(Build, AGapBetweenSourcesIsNotBlackGround) {
  const auto west = raster("west.tif", {}, [](int, int, int) { return 10; });
  const auto east = raster("east.tif", {.left = 505000}, [](int, int, int) { return 20; });
  ASSERT_TRUE(build(options({west, east})));
  const auto mask = read_mask(path("map.tif"), 0);
  for (std::size_t i = 0; i < mask.size(); ++i) ASSERT_EQ(mask[i], i % 756 < 256 || i % 756 >= 500 ? 255 : 0);
}

TEST_F(Build, SourcesOfAnotherTypeAndTexelSizeComeOntoOneGrid) {
  const auto first = raster("first.tif", {}, [](int, int, int) { return 100; });
  const auto finer = raster("finer.tif", {.type = GDT_UInt16, .left = 500000 + 256 * 10, .texel = 5},
                            [](int, int, int) { return 1000; });
  auto o = options({first, finer});
  ASSERT_TRUE(build(o));
  const auto map = open(o.output);
  EXPECT_EQ(map->GetRasterXSize(), 2 * 256 + 256);  // the finest source decides
  EXPECT_EQ(map->GetRasterBand(1)->GetRasterDataType(), GDT_UInt16);
  const auto samples = read_level(o.output, 0, 1);
  EXPECT_EQ(samples[0], 100);
  EXPECT_EQ(samples[600], 1000);
  EXPECT_EQ(read_mask(o.output, 0)[400 * 768 + 600], 0);  // below the finer one
}

/// A field that is the same wherever it is looked at from.
double hills(double lon, double lat) { return 1000 + 500 * std::sin(lon * 900) * std::cos(lat * 700); }

TEST_F(Build, SourcesOfTwoUtmZonesMeetWhereTheyShould) {
  const auto value_of = [](int epsg, double left, double top, double texel) {
    OGRSpatialReference utm, geographic;
    utm.importFromEPSG(epsg);
    geographic.importFromEPSG(4326);
    geographic.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    const std::shared_ptr<OGRCoordinateTransformation> to_degrees{OGRCreateCoordinateTransformation(&utm, &geographic)};
    return [=](int x, int y, int) {
      double lon = left + (x + 0.5) * texel, lat = top - (y + 0.5) * texel;
      to_degrees->Transform(1, &lon, &lat);
      return hills(lon, lat);
    };
  };
  // Both sides of 6 degrees west, the border of zones 29 and 30
  const Shape west{.width = 300, .height = 256, .type = GDT_Float32, .epsg = 32629, .left = 759000, .top = 4200000};
  const Shape east{.width = 300, .height = 256, .type = GDT_Float32, .epsg = 32630, .left = 238000, .top = 4200000};
  const auto a = raster("west.tif", west, value_of(32629, west.left, west.top, west.texel));
  const auto b = raster("east.tif", east, value_of(32630, east.left, east.top, east.texel));
  auto o = options({a, b});
  o.interpolation = mosaic::Interpolation::Cubic;
  ASSERT_TRUE(build(o));
  const auto map = open(o.output);
  std::array<double, 6> g{};
  map->GetGeoTransform(g.data());
  const auto truth = value_of(32629, g[0], g[3], g[1]);
  const auto samples = read_level(o.output, 0, 1);
  const auto mask = read_mask(o.output, 0);
  const int width = map->GetRasterXSize(), height = map->GetRasterYSize();
  double worst = 0;
  int valid = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto i = static_cast<std::size_t>(y * width + x);
      // The outermost texels of the map go half a texel beyond the centres of the sources'.
      const auto is_valid = [&](int col, int row) {
        return col >= 0 && row >= 0 && col < width && row < height &&
               mask[static_cast<std::size_t>(row * width + col)] > 0;
      };
      bool inside = true;
      for (const int dy : {-2, 0, 2})
        for (const int dx : {-2, 0, 2}) inside &= is_valid(x + dx, y + dy);
      if (!inside) continue;
      ++valid;
      worst = std::max(worst, std::abs(samples[i] - truth(x, y, 1)));
    }
  }
  EXPECT_GT(valid, 300 * 256);
  // 0.05 texels of 10 m where a wave of 500 in 900 per degree, 0.08 a metre, is steepest; and the cubic's own error.
  const double steepest = 500 * 900 / (111320 * std::cos(0.66));
  EXPECT_LT(worst, 0.05 * 10 * steepest + 0.5);
}

TEST_F(Build, AMapIsRenderedOntoAnotherGrid) {
  const auto source = raster("source.tif", {.width = 400, .height = 300, .type = GDT_Float32},
                             [](int x, int y, int) { return x + 1000 * y; });
  auto o = options({source});
  o.grid.gsd = 20;
  o.grid.extent = {{501000, 4198000, 503000, 4199500}};
  ASSERT_TRUE(build(o));
  auto map = open(o.output);
  ASSERT_EQ(map->GetRasterXSize(), 100);
  ASSERT_EQ(map->GetRasterYSize(), 75);
  std::array<double, 6> g{};
  map->GetGeoTransform(g.data());
  EXPECT_EQ(g[0], 501000);
  EXPECT_EQ(g[3], 4199500);
  // The mean of 2 x 2 texels from (100, 50) on
  EXPECT_NEAR(read_level(o.output, 0, 1)[0], 100.5 + 50.5 * 1000, 0.1);
}

TEST_F(Build, SourcesThatCannotGoTogetherAreNamed) {
  const auto value = [](int, int, int) { return 1; };
  const auto first = raster("first.tif", {.bands = 2}, value);
  const auto other = raster("other.tif", {.bands = 5, .type = GDT_UInt16}, value);
  const std::string message = failure(options({first, other}));
  EXPECT_EQ(message.find(other), 0u) << message;
  EXPECT_NE(message.find("bands"), std::string::npos) << message;
}

TEST_F(Build, WhatDescribesTheBandsIsKept) {
  const auto source = raster(
      "s2.tif", {.bands = 2, .type = GDT_Int16}, [](int x, int, int) { return x; },
      [](GDALDataset& d) {
        d.SetMetadataItem("MISSION", "test");
        for (int b = 1; b <= 2; ++b) {
          GDALRasterBand& band = *d.GetRasterBand(b);
          band.SetDescription(b == 1 ? "B4" : "B8");
          band.SetNoDataValue(-1);
          band.SetScale(0.0001);
          band.SetOffset(-0.1);
          band.SetUnitType("reflectance");
        }
      });
  auto o = options({source});
  o.role = tile::Role::Optical;
  o.acquired = "2019-09-18";
  o.attribution = "contains <modified> Copernicus & other data";
  o.licence = "CC BY 4.0";
  ASSERT_TRUE(build(o));
  const auto map = tile::describe(o.output.string());
  ASSERT_TRUE(map);
  EXPECT_EQ(map->layout, "COG");
  EXPECT_EQ(map->compression, "ZSTD");
  EXPECT_EQ(map->acquired, "2019-09-18");
  EXPECT_EQ(map->attribution, "contains <modified> Copernicus & other data");
  EXPECT_EQ(map->licence, "CC BY 4.0");
  EXPECT_EQ(map->role, "optical");
  ASSERT_EQ(map->bands.size(), 2u);
  EXPECT_EQ(map->bands[0].name, "B4");
  EXPECT_EQ(map->bands[1].name, "B8");
  for (const auto& band : map->bands) {
    EXPECT_EQ(band.nodata, -1);
    EXPECT_EQ(band.scale, 0.0001);
    EXPECT_EQ(band.offset, -0.1);
    EXPECT_EQ(band.unit, "reflectance");
  }
  EXPECT_STREQ(open(o.output)->GetMetadataItem("MISSION"), "test");

  // Built again from itself, with nothing said, it keeps all that.
  ASSERT_TRUE(build(options({o.output.string()}, "again.tif")));
  const auto again = tile::describe(path("again.tif").string());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->role, "optical");
  EXPECT_EQ(again->acquired, "2019-09-18");
}

TEST_F(Build, BandsAreChosenByNameAndAlphaStays) {
  const auto source = raster(
      "eo.tif", {.bands = 4}, [](int, int, int b) { return 10 * b; },
      [](GDALDataset& d) { d.GetRasterBand(3)->SetDescription("blue"); });
  auto o = options({source});
  o.bands = {"blue", "1"};
  ASSERT_TRUE(build(o));
  auto map = open(o.output);
  ASSERT_EQ(map->GetRasterCount(), 3);
  EXPECT_EQ(read_band(*map->GetRasterBand(1)).front(), 30);
  EXPECT_EQ(read_band(*map->GetRasterBand(2)).front(), 10);
  EXPECT_EQ(map->GetRasterBand(3)->GetColorInterpretation(), GCI_AlphaBand);

  o.output = path("other.tif");
  o.bands = {"blu"};
  EXPECT_NE(failure(o).find("did you mean 'blue'"), std::string::npos);
}

TEST_F(Build, AMapThatIsThereStaysUnlessForced) {
  const auto source = raster("eo.tif", {}, [](int, int, int) { return 1; });
  auto o = options({source});
  std::ofstream(o.output) << "precious";
  const auto refused = build(o);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, Error::Kind::Exists);
  EXPECT_EQ(fs::file_size(o.output), 8u);

  // Levels that lay beside the old map do not belong to the new one.
  const auto stale = path("map.tif.ovr");
  std::ofstream(stale) << "levels of another map";
  o.force = true;
  ASSERT_TRUE(build(o));
  EXPECT_FALSE(fs::exists(stale));
  expect_all(read_level(o.output, 0, 1), 1, 0);
}

TEST_F(Build, AMapCanBeBuiltOntoItsOwnSource) {
  auto o = options({raster("map.tif", {}, [](int x, int, int) { return x; })});
  o.force = true;
  ASSERT_TRUE(build(o));
  EXPECT_EQ(tile::describe(o.output.string())->layout, "COG");
  EXPECT_EQ(read_level(o.output, 0, 1)[200], 200);
}

TEST_F(Build, LevelsOfAWebpMapWithoutLossAreWithoutLossToo) {
  std::mt19937 random(1);
  const auto source = raster("noise.tif", {.bands = 3, .type = GDT_Byte},
                             [&](int, int, int) { return static_cast<double>(random() % 256); });
  auto webp = options({source}, "webp.tif"), none = options({source}, "none.tif");
  webp.compression = Compression::Webp;
  webp.quality = 100;
  none.compression = Compression::None;
  ASSERT_TRUE(build(webp));
  ASSERT_TRUE(build(none));
  for (const int level : {0, 1, 2})
    for (const int band : {1, 2, 3})
      EXPECT_EQ(read_level(webp.output, level, band), read_level(none.output, level, band)) << level << " " << band;
}

TEST_F(Build, AFullDiskIsReportedAndLeavesNothing) {
  std::mt19937 random(1);
  for (const GDALDataType type : {GDT_Byte, GDT_Float32}) {  // levels reduced by GDAL, and by us
    const auto source = raster(fmt::format("noise{}.tif", static_cast<int>(type)), {.type = type},
                               [&](int, int, int) { return static_cast<double>(random() % 256); });
    testing::internal::CaptureStderr();
    const std::string message = [&] {
      const test::SmallDisk disk(20'000);
      return failure(options({source}));
    }();
    const std::string printed = testing::internal::GetCapturedStderr();
    EXPECT_NE(message.find("disk full"), std::string::npos) << message;
    EXPECT_NE(message.find("map.tif"), std::string::npos) << message;
    EXPECT_EQ(printed, "");
  }
}

TEST_F(Build, ASourceCutShortIsAnErrorAtAnyLength) {
  const auto source = raster("eo.tif", {.bands = 3, .type = GDT_UInt16},
                             [](int x, int y, int b) { return (x * 7 + y * 13 + b) % 60000; });
  const auto whole = fs::file_size(source);
  for (int eighths = 0; eighths < 8; ++eighths) {
    const auto cut = path("cut.tif");
    fs::copy_file(source, cut, fs::copy_options::overwrite_existing);
    fs::resize_file(cut, whole * static_cast<std::uintmax_t>(eighths) / 8);
    testing::internal::CaptureStderr();
    const std::string message = failure(options({cut.string()}));
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "at " << eighths << " eighths";
    EXPECT_NE(message, "") << "at " << eighths << " eighths";
  }
}

TEST_F(Build, ErrorsNameTheFileAndWhatToDo) {
  const auto value = [](int, int, int) { return 1; };
  const auto no_crs = raster("no_crs.tif", {.epsg = 0}, value);
  const auto wide = raster("wide.tif", {.bands = 4, .type = GDT_UInt16}, value);
  const auto expect = [&](const BuildOptions& o, const std::string& what) {
    const std::string message = failure(o);
    EXPECT_NE(message.find(what), std::string::npos) << message;
  };
  expect(options({path("missing.tif").string()}), "missing.tif: no such file");
  expect(options({no_crs}),
         "no_crs.tif: expected a georeferenced raster, found no geotransform: assign one with gdal_edit.py");
  fs::create_directories(path("empty"));
  expect(options({path("empty").string()}), "empty: ");
  expect(options({}), "no source");
  auto jpeg = options({wide});
  jpeg.compression = Compression::Jpeg;
  expect(jpeg, "wide.tif: jpeg stores 1 or 3 bands of 8 bits, found 4 of type uint16; choose --compress zstd");
  auto quality = options({wide});
  quality.quality = 50;
  expect(quality, "quality 50");
  auto labels = options({raster("classes.tif", {}, value)});
  labels.role = tile::Role::Labels;
  labels.compression = Compression::Jpeg;
  expect(labels, "its samples are labels");
  auto date = options({wide});
  date.acquired = "20 July 2014";
  expect(date, "expected a date such as 2014-07-20");
  auto scale = options({wide});
  scale.radar_scale = tile::RadarScale::Decibel;
  expect(scale, "it is for role radar");
}

TEST_F(Build, GdalsOwnCheckFindsAValidCog) {
  const std::string check = "/usr/bin/python3 -m osgeo_utils.samples.validate_cloud_optimized_geotiff ";
  if (std::system("/usr/bin/python3 -c 'import osgeo_utils' 2>/dev/null") != 0)
    GTEST_SKIP() << "needs GDAL's Python scripts";
  const auto eo = raster("eo.tif", {.width = 700, .height = 411, .bands = 4},
                         [](int x, int y, int b) { return b == 4 ? (x < 300 ? 0 : 255) : (x + y) % 256; });
  const auto radar = raster("s1.tif", {.width = 700, .height = 411, .bands = 2, .type = GDT_Float32},
                            [](int x, int, int) { return x * 0.1 - 20; });
  auto plain = options({eo}, "plain.tif"), jpeg = options({eo}, "jpeg.tif"), sar = options({radar}, "sar.tif");
  jpeg.compression = Compression::Jpeg;
  sar.role = tile::Role::Radar;
  for (const auto& o : {plain, jpeg, sar}) {
    ASSERT_TRUE(build(o));
    EXPECT_EQ(std::system((check + o.output.string() + " >/dev/null").c_str()), 0) << o.output;
  }
}

TEST_F(Build, TheFileDoesNotDependOnTheNumberOfThreads) {
  const auto source = raster("eo.tif", {.width = 700, .height = 411, .bands = 3},
                             [](int x, int y, int b) { return (x * x + y * b) % 256; });
  const auto bytes = [&](int threads) {
    auto o = options({source}, fmt::format("map{}.tif", threads));
    o.threads = threads;
    EXPECT_TRUE(build(o));
    std::ifstream file(o.output, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  EXPECT_EQ(bytes(1), bytes(4));
}

}  // namespace
}  // namespace nadir::pyramid

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "mosaic/raster_file.h"
#include "nadir/mosaic/source.h"
#include "overlap.h"
#include "sample_types.h"
#include "support/temporary_folder.h"

// What rasters become that go into one map.
namespace nadir::mosaic {
namespace {

using test::TemporaryFolder;

/// Files of a test, written into a folder, and the map that they make.
class Map {
 public:
  std::string add(const RasterFile& file) {
    options.names.push_back(folder_.file(std::to_string(options.names.size()) + ".tif"));
    write(file, options.names.back());
    return options.names.back();
  }
  Sources open() const {
    auto sources = open_sources(options);
    EXPECT_TRUE(sources) << sources.error().message;
    return sources ? *sources : Sources{};
  }
  std::string error() const {
    const auto sources = open_sources(options);
    EXPECT_FALSE(sources);
    return sources ? "" : sources.error().message;
  }

  SourceOptions options;

 private:
  TemporaryFolder folder_;
};

/// One texel of a source: its bands, and with a mask 1 or 0 more.
std::vector<double> texel(const Sources& sources, std::size_t source, int x, int y) {
  Block block(sources.type, {x, y, 1, 1});
  const auto read = sources.rasters[source]->read(block);
  EXPECT_TRUE(read) << read.error().message;
  std::vector<double> values = samples_of(block, sources.type);
  if (sources.type.mask) values.push_back(validity_of(block)[0] ? 1 : 0);
  return values;
}

/// A raster that holds a value in each band, and `other` at (1, 0).
RasterFile constant(GDALDataType type, int bands, double value, double other) {
  RasterFile file;
  file.type = type;
  file.bands = bands;
  file.width = file.height = 4;
  file.value = [=](int b, int x, int y) { return (x == 1 && y == 0 ? other : value) + (bands > 1 ? b : 0); };
  return file;
}

RasterFile rgb(double value, double other) {
  RasterFile file = constant(GDT_Byte, 3, value, other);
  file.options = {"PHOTOMETRIC=RGB"};
  return file;
}

using Values = std::vector<double>;

TEST(CommonType, IsTheSmallestThatHoldsAll) {
  using enum tiff::Sample;
  EXPECT_EQ(common_type(U8, U16), U16);
  EXPECT_EQ(common_type(U8, I16), I16);
  EXPECT_EQ(common_type(U8, I8), I16);
  EXPECT_EQ(common_type(U16, I16), I32);
  EXPECT_EQ(common_type(U16, I8), I32);
  EXPECT_EQ(common_type(U32, I32), F64);
  EXPECT_EQ(common_type(U16, F32), F32);
  EXPECT_EQ(common_type(U32, F32), F64);
  EXPECT_EQ(common_type(I32, F32), F64);
  EXPECT_EQ(common_type(U8, F64), F64);
  EXPECT_EQ(common_type(U32, U64), U64);
  EXPECT_EQ(common_type(U32, I64), I64);
  EXPECT_EQ(common_type(U64, I64), F64);
  EXPECT_EQ(common_type(I8, U64), F64);
  for (int a = 0; a < 10; ++a)
    for (int b = 0; b < 10; ++b)
      EXPECT_EQ(common_type(static_cast<Sample>(a), static_cast<Sample>(b)),
                common_type(static_cast<Sample>(b), static_cast<Sample>(a)));
}

TEST(Types, GrowToHoldAllSources) {
  Map map;
  map.add(constant(GDT_UInt16, 1, 65535, 0));
  map.add(constant(GDT_Int16, 1, -32768, 0));
  const Sources sources = map.open();
  EXPECT_EQ(sources.type.sample, Sample::I32);
  EXPECT_EQ(texel(sources, 0, 0, 0), Values{65535});
  EXPECT_EQ(texel(sources, 1, 0, 0), Values{-32768});
}

TEST(Types, OfMixedIntegersOf64BitsBecomeFloatsWithAWarning) {
  Map map;
  map.add(constant(GDT_UInt64, 1, 5, 0));
  map.add(constant(GDT_Int64, 1, -5, 0));
  const Sources sources = map.open();
  EXPECT_EQ(sources.type.sample, Sample::F64);
  ASSERT_EQ(sources.warnings.size(), 1u);
  EXPECT_NE(sources.warnings[0].find("53 bits"), std::string::npos);
  EXPECT_EQ(texel(sources, 1, 0, 0), Values{-5});
}

TEST(Bands, AreMatchedByName) {
  Map map;
  RasterFile file = constant(GDT_UInt16, 2, 10, 0);
  file.names = {"VV", "VH"};
  map.add(file);
  file = constant(GDT_UInt16, 3, 20, 0);
  file.names = {"VH", "angle", "VV"};
  map.add(file);
  const Sources sources = map.open();
  EXPECT_EQ(texel(sources, 1, 0, 0), (Values{22, 20}));
  ASSERT_EQ(sources.bands.size(), 2u);
  EXPECT_EQ(sources.bands[0].name, "VV");
  ASSERT_EQ(sources.warnings.size(), 1u) << "'angle' is left out";
}

TEST(Bands, AreMatchedByColor) {
  Map map;
  map.add(rgb(10, 0));
  RasterFile file = constant(GDT_Byte, 3, 20, 0);
  file.options = {"PHOTOMETRIC=MINISBLACK"};
  file.colors = {GCI_BlueBand, GCI_GreenBand, GCI_RedBand};
  map.add(file);
  EXPECT_EQ(texel(map.open(), 1, 0, 0), (Values{22, 21, 20}));
}

TEST(Bands, ElseByPosition) {
  Map map;
  map.add(constant(GDT_UInt16, 2, 10, 0));
  map.add(constant(GDT_UInt16, 2, 20, 0));
  EXPECT_EQ(texel(map.open(), 1, 0, 0), (Values{20, 21}));
}

TEST(Bands, ThatAreMissingAreAnErrorThatNamesBothSources) {
  Map map;
  const std::string first = map.add(constant(GDT_UInt16, 4, 10, 0));
  const std::string second = map.add(constant(GDT_UInt16, 2, 20, 0));
  const std::string error = map.error();
  EXPECT_TRUE(error.starts_with(second)) << error;
  EXPECT_NE(error.find(first), std::string::npos) << error;
  EXPECT_NE(error.find("--bands"), std::string::npos) << error;
}

TEST(Bands, AreChosenByNumberAndNameAndAlphaStays) {
  Map map;
  RasterFile file = constant(GDT_Byte, 4, 10, 0);
  file.options = {"ALPHA=YES", "PHOTOMETRIC=RGB"};
  file.names = {"r", "g", "b", ""};
  map.add(file);
  map.options.bands = {"3", "r"};
  const Sources sources = map.open();
  EXPECT_EQ(sources.type.bands, 3);
  EXPECT_TRUE(sources.type.alpha);
  EXPECT_EQ(texel(sources, 0, 0, 0), (Values{12, 10, 13}));
  ASSERT_EQ(sources.bands.size(), 3u);
  EXPECT_EQ(sources.bands[0].name, "b");
  EXPECT_EQ(sources.bands[2].color, "Alpha");
  map.options.bands = {"green"};
  EXPECT_NE(map.error().find("no band 'green'"), std::string::npos);
}

TEST(Bands, OfGreyBecomeColorsBesideColors) {
  for (const bool grey_first : {true, false}) {
    Map map;
    if (grey_first) map.add(constant(GDT_Byte, 1, 7, 0));
    map.add(rgb(10, 0));
    if (!grey_first) map.add(constant(GDT_Byte, 1, 7, 0));
    const Sources sources = map.open();
    EXPECT_EQ(sources.type.bands, 3);
    EXPECT_EQ(texel(sources, grey_first ? 0 : 1, 0, 0), (Values{7, 7, 7}));
    EXPECT_EQ(texel(sources, grey_first ? 1 : 0, 0, 0), (Values{10, 11, 12}));
    EXPECT_EQ(sources.bands[0].color, "Red");
  }
}

TEST(Bands, OfDifferentScalesAreAnError) {
  Map map;
  const std::string first = map.add(constant(GDT_Int16, 1, 10, 0));
  map.add(constant(GDT_Int16, 1, 10, 0));
  {
    const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(first.c_str(), GDAL_OF_UPDATE));
    dataset->GetRasterBand(1)->SetScale(0.01);
  }
  EXPECT_NE(map.error().find("scale 1 "), std::string::npos);
}

TEST(Nodata, ThatAllShareIsKept) {
  Map map;
  for (int i = 0; i < 2; ++i) {
    RasterFile file = constant(i ? GDT_UInt16 : GDT_Byte, 1, 10, 255);
    file.nodata = {255.0};
    map.add(file);
  }
  const Sources sources = map.open();
  EXPECT_EQ(sources.type.nodata, 255.0);
  EXPECT_FALSE(sources.type.mask);
  EXPECT_EQ(texel(sources, 0, 1, 0), Values{255});
}

TEST(Nodata, ThatDiffersBetweenIntegersBecomesAMask) {
  Map map;
  for (const double nodata : {0.0, 255.0}) {
    RasterFile file = constant(GDT_Byte, 1, 255 - nodata, nodata);
    file.nodata = {nodata};
    map.add(file);
  }
  const Sources sources = map.open();
  EXPECT_FALSE(sources.type.nodata);
  ASSERT_TRUE(sources.type.mask);
  EXPECT_EQ(texel(sources, 0, 0, 0), (Values{255, 1})) << "valid, though it is nodata in the other";
  EXPECT_EQ(texel(sources, 0, 1, 0), (Values{0, 0}));
  EXPECT_EQ(texel(sources, 1, 0, 0), (Values{0, 1}));
  EXPECT_EQ(texel(sources, 1, 1, 0), (Values{255, 0}));
}

TEST(Nodata, ThatOnlySomeHaveBecomesAMask) {
  Map map;
  RasterFile file = constant(GDT_Byte, 1, 10, 0);
  map.add(file);
  file.nodata = {0.0};
  map.add(file);
  const Sources sources = map.open();
  ASSERT_TRUE(sources.type.mask);
  EXPECT_EQ(texel(sources, 0, 1, 0), (Values{0, 1}));
  EXPECT_EQ(texel(sources, 1, 1, 0), (Values{0, 0}));
}

TEST(Nodata, ThatDiffersBetweenFloatsBecomesNaN) {
  Map map;
  for (const double nodata : {-9999.0, 0.1, std::numeric_limits<double>::quiet_NaN()}) {
    RasterFile file = constant(GDT_Float32, 1, 10, nodata);
    file.nodata = {nodata};
    map.add(file);
  }
  RasterFile file = constant(GDT_Int16, 1, 10, -5);
  file.nodata = {-5.0};
  map.add(file);
  const Sources sources = map.open();
  EXPECT_FALSE(sources.type.mask);
  ASSERT_TRUE(sources.type.nodata && std::isnan(*sources.type.nodata));
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_TRUE(same_samples(texel(sources, i, 1, 0), {std::nan("")})) << i;
    EXPECT_EQ(texel(sources, i, 0, 0), Values{10}) << i;
  }
}

TEST(Nodata, ThatTheTypeCanNeverHoldIsNone) {
  Map map;
  RasterFile file = constant(GDT_Byte, 1, 10, 0);
  file.nodata = {-9999.0};
  map.add(file);
  EXPECT_FALSE(map.open().type.nodata);
}

/// A virtual raster of two bands with a nodata value each: a GeoTIFF holds one.
std::string two_nodata(const TemporaryFolder& folder, GDALDataType type) {
  RasterFile file = constant(type, 2, 10, -1);
  write(file, folder.file("two.tif"));
  const std::string band = R"(<SimpleSource><SourceFilename relativeToVRT="1">two.tif</SourceFilename><SourceBand>)";
  std::string xml = R"(<VRTDataset rasterXSize="4" rasterYSize="4">)";
  for (const char* number : {"1", "2"})
    xml += std::string("<VRTRasterBand dataType=\"") + GDALGetDataTypeName(type) + "\" band=\"" + number +
           "\"><NoDataValue>" + (*number == '1' ? "-1" : "0") + "</NoDataValue>" + band + number +
           "</SourceBand></SimpleSource></VRTRasterBand>";
  return folder.write("two.vrt", xml + "</VRTDataset>");
}

TEST(Nodata, ThatDiffersBetweenBandsIsNaNInFloatsAndAnErrorInIntegers) {
  const TemporaryFolder folder;
  Map map;
  map.options.names = {two_nodata(folder, GDT_Float32)};
  const Sources sources = map.open();
  ASSERT_TRUE(sources.type.nodata && std::isnan(*sources.type.nodata));
  EXPECT_TRUE(same_samples(texel(sources, 0, 1, 0), {std::nan(""), std::nan("")}));
  EXPECT_EQ(texel(sources, 0, 0, 0), (Values{10, 11}));
  map.options.names = {two_nodata(folder, GDT_Int16)};
  EXPECT_NE(map.error().find("bands 1 and 2 have different nodata"), std::string::npos);
  map.options.bands = {"2"};
  EXPECT_EQ(map.open().type.nodata, 0.0);
}

TEST(Nodata, BecomesAMaskWhereAsked) {
  Map map;
  RasterFile file = rgb(10, 0);
  file.value = [](int b, int x, int) { return x == 1 ? 0 : x == 2 ? b : 10; };
  file.nodata = {0.0, 0.0, 0.0};
  map.add(file);
  map.options.nodata_to_mask = true;
  const Sources sources = map.open();
  EXPECT_FALSE(sources.type.nodata);
  ASSERT_TRUE(sources.type.mask);
  EXPECT_EQ(texel(sources, 0, 0, 0), (Values{10, 10, 10, 1}));
  EXPECT_EQ(texel(sources, 0, 1, 0), (Values{0, 0, 0, 0}));
  EXPECT_EQ(texel(sources, 0, 2, 0), (Values{0, 1, 2, 1})) << "not all bands are nodata";
}

TEST(Masks, OfSomeBecomeAMaskOfAll) {
  Map map;
  map.add(constant(GDT_Byte, 1, 10, 20));
  RasterFile file = constant(GDT_Byte, 1, 10, 20);
  file.mask = true;
  map.add(file);
  const Sources sources = map.open();
  ASSERT_TRUE(sources.type.mask);
  EXPECT_EQ(texel(sources, 0, 0, 0), (Values{10, 1}));
  EXPECT_EQ(texel(sources, 1, 0, 0), (Values{10, 0}));
}

TEST(Alpha, IsOpaqueWhereASourceHasNone) {
  Map map;
  RasterFile file = constant(GDT_Byte, 4, 10, 20);
  file.options = {"ALPHA=YES", "PHOTOMETRIC=RGB"};
  map.add(file);
  map.add(rgb(30, 0));
  RasterFile masked = rgb(40, 0);
  masked.mask = true;
  map.add(masked);
  RasterFile nodata = rgb(50, 0);
  nodata.value = [](int, int x, int) { return x == 1 ? 0 : 50; };
  nodata.nodata = {0.0, 0.0, 0.0};
  map.add(nodata);
  const Sources sources = map.open();
  EXPECT_TRUE(sources.type.alpha);
  EXPECT_FALSE(sources.type.mask);
  EXPECT_FALSE(sources.type.nodata);
  EXPECT_EQ(texel(sources, 0, 0, 0), (Values{10, 11, 12, 13}));
  EXPECT_EQ(texel(sources, 1, 0, 0), (Values{30, 31, 32, 255}));
  EXPECT_EQ(texel(sources, 2, 0, 0)[3], 0) << "masked out";
  EXPECT_EQ(texel(sources, 3, 0, 0)[3], 255);
  EXPECT_EQ(texel(sources, 3, 1, 0)[3], 0) << "nodata";
}

TEST(Alpha, GrowsWithTheType) {
  Map map;
  RasterFile file = constant(GDT_Byte, 2, 254, 9);
  file.options = {"ALPHA=YES"};
  map.add(file);
  map.add(constant(GDT_UInt16, 1, 1000, 0));
  const Sources sources = map.open();
  EXPECT_EQ(texel(sources, 0, 0, 0), (Values{254, 65535}));
  EXPECT_EQ(texel(sources, 0, 1, 0), (Values{9, 10 * 257}));
  EXPECT_EQ(texel(sources, 1, 0, 0), (Values{1000, 65535}));
}

TEST(Alpha, FromHalfOnIsValidInAMask) {
  Map map;
  RasterFile file = constant(GDT_Byte, 2, 0, 0);
  file.value = [](int b, int x, int) { return b == 0 ? 9 : 126 + x; };
  file.options = {"ALPHA=YES"};
  map.add(file);
  map.options.alpha_to_mask = true;
  const Sources sources = map.open();
  EXPECT_EQ(sources.type.bands, 1);
  EXPECT_FALSE(sources.type.alpha);
  EXPECT_EQ(texel(sources, 0, 1, 0), (Values{9, 0})) << "127 of 255";
  EXPECT_EQ(texel(sources, 0, 2, 0), (Values{9, 1})) << "128 of 255";
}

RasterFile indexed(std::vector<std::array<short, 4>> palette) {
  RasterFile file = constant(GDT_Byte, 1, 0, 1);
  file.palette = std::move(palette);
  return file;
}

TEST(Palettes, ThatAreTheSameAreKept) {
  Map map;
  map.add(indexed({{1, 2, 3, 255}, {250, 100, 50, 255}}));
  map.add(indexed({{1, 2, 3, 255}, {250, 100, 50, 255}}));
  const Sources sources = map.open();
  EXPECT_EQ(sources.type.bands, 1);
  ASSERT_EQ(sources.palette.size(), 3u * 256);
  EXPECT_EQ(sources.palette[1], 250 * 257);
  EXPECT_EQ(sources.palette[256], 2 * 257);
  EXPECT_EQ(sources.palette[512 + 1], 50 * 257);
  EXPECT_EQ(sources.bands[0].color, "Palette");
  EXPECT_EQ(texel(sources, 1, 1, 0), Values{1});
  map.options.expand_palettes = true;
  EXPECT_EQ(texel(map.open(), 1, 1, 0), (Values{250, 100, 50}));
}

TEST(Palettes, ThatDifferBecomeColors) {
  Map map;
  map.add(indexed({{1, 2, 3, 255}, {250, 100, 50, 255}}));
  map.add(indexed({{1, 2, 3, 255}, {9, 100, 50, 255}}));
  map.add(rgb(10, 0));
  const Sources sources = map.open();
  EXPECT_TRUE(sources.palette.empty());
  EXPECT_EQ(sources.bands[0].color, "Red");
  EXPECT_EQ(texel(sources, 0, 1, 0), (Values{250, 100, 50}));
  EXPECT_EQ(texel(sources, 1, 1, 0), (Values{9, 100, 50}));
  EXPECT_EQ(texel(sources, 1, 0, 0), (Values{1, 2, 3}));
}

TEST(Palettes, WithTransparencyBecomeColorsAndAlpha) {
  const TemporaryFolder folder;
  RasterFile file = indexed({{1, 2, 3, 255}, {250, 100, 50, 40}});
  file.driver = "PNG";
  write(file, folder.file("see_through.png"));
  Map map;
  map.options.names = {folder.file("see_through.png")};
  const Sources sources = map.open();
  EXPECT_TRUE(sources.type.alpha);
  EXPECT_EQ(texel(sources, 0, 0, 0), (Values{1, 2, 3, 255}));
  EXPECT_EQ(texel(sources, 0, 1, 0), (Values{250, 100, 50, 40}));
}

TEST(Palettes, WithNodataKeepItOrBecomeColorsUnderAMask) {
  RasterFile file = indexed({{1, 2, 3, 255}, {250, 100, 50, 255}});
  file.nodata = {1.0};
  Map map;
  map.add(file);
  EXPECT_EQ(map.open().type.nodata, 1.0);
  map.options.expand_palettes = true;
  const Sources sources = map.open();
  EXPECT_FALSE(sources.type.nodata);
  ASSERT_TRUE(sources.type.mask);
  EXPECT_EQ(texel(sources, 0, 0, 0), (Values{1, 2, 3, 1}));
  EXPECT_EQ(texel(sources, 0, 1, 0).back(), 0);
}

TEST(Metadata, OnWhichAllAgreeIsKept) {
  Map map;
  RasterFile file = constant(GDT_Byte, 1, 0, 0);
  file.metadata = {{"mission", "7"}, {"flight", "1"}, {"AREA_OR_POINT", "Point"}};
  map.add(file);
  file.metadata["flight"] = "2";
  map.add(file);
  const Sources sources = map.open();
  EXPECT_EQ(sources.metadata, (std::vector<std::pair<std::string, std::string>>{{"mission", "7"}}));
  EXPECT_TRUE(sources.pixel_is_point);
}

TEST(Metadata, StatisticsAreNotHandedOn) {
  Map map;
  const std::string path = map.add(constant(GDT_Byte, 1, 3, 9));
  {
    const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(path.c_str(), GDAL_OF_UPDATE));
    dataset->GetRasterBand(1)->SetMetadataItem("STATISTICS_MEAN", "3.4");
    dataset->GetRasterBand(1)->SetMetadataItem("wavelength", "0.6");
    dataset->GetRasterBand(1)->SetUnitType("m");
  }
  const Sources sources = map.open();
  EXPECT_EQ(sources.bands[0].metadata, (std::vector<std::pair<std::string, std::string>>{{"wavelength", "0.6"}}));
  EXPECT_EQ(sources.bands[0].unit, "m");
}

TEST(Overlap, OrdersSourcesAsAsked) {
  Map map;
  const auto dated = [&](const char* key, const char* time, double texel_m) {
    RasterFile file = constant(GDT_Byte, 1, 0, 0);
    if (*time) file.metadata[key] = time;
    file.place = {500000, texel_m, 0, 5000000, 0, -texel_m};
    return map.add(file);
  };
  const std::string june = dated("NADIR_ACQUIRED", "2024-06-01T00:00:00Z", 1);
  const std::string none = dated("", "", 0.5);
  const std::string may = dated("TIFFTAG_DATETIME", "2024:05:01 12:00:00", 2);
  const std::string july = dated("ACQUISITIONDATETIME", "20240701", 1);
  const auto order = [&](Overlap overlap) {
    map.options.overlap = overlap;
    std::vector<std::string> labels;
    for (const auto& source : map.open().rasters) labels.push_back(source->label());
    return labels;
  };
  using Labels = std::vector<std::string>;
  EXPECT_EQ(order(Overlap::Last), (Labels{june, none, may, july}));
  EXPECT_EQ(order(Overlap::First), (Labels{july, may, none, june}));
  EXPECT_EQ(order(Overlap::Newest), (Labels{none, may, june, july}));
  EXPECT_EQ(order(Overlap::Oldest), (Labels{none, july, june, may}));
  EXPECT_EQ(order(Overlap::Finest), (Labels{may, june, july, none})) << "ties as given";
  map.options.overlap = Overlap::Newest;
  const Sources sources = map.open();
  ASSERT_EQ(sources.warnings.size(), 1u);
  EXPECT_NE(sources.warnings[0].find(none), std::string::npos);
}

TEST(Overlap, OfDegreesAndMetresIsMeasuredOnTheGround) {
  Map map;
  RasterFile metres = constant(GDT_Byte, 1, 0, 0);  // 1 m
  RasterFile degrees = metres;
  degrees.crs = "EPSG:4326";
  degrees.place = {-99, 1e-6, 0, 45, 0, -1e-6};  // 0.1 m
  const std::string fine = map.add(degrees);
  map.add(metres);
  map.options.overlap = Overlap::Finest;
  EXPECT_EQ(map.open().rasters.back()->label(), fine);
}

TEST(Overlap, IsNamed) {
  for (const auto overlap : {Overlap::Last, Overlap::First, Overlap::Newest, Overlap::Oldest, Overlap::Finest})
    EXPECT_EQ(parse_overlap(to_string(overlap)), overlap);
  EXPECT_NE(parse_overlap("newst").error().message.find("newest"), std::string::npos);
}

TEST(Times, AreReadInTheFormsOfMetadata) {
  const double day = 1715904000;  // 2024-05-17T00:00:00Z, by date(1)
  EXPECT_EQ(parse_time("2024-05-17"), day);
  EXPECT_EQ(parse_time("20240517"), day);
  EXPECT_EQ(parse_time("2024:05:17 10:20:30"), day + 37230);
  EXPECT_EQ(parse_time("2024-05-17T10:20:30.5Z"), day + 37230.5);
  EXPECT_EQ(parse_time("2024-05-17T10:20:30+02:00"), day + 30030);
  EXPECT_EQ(parse_time("20240517T102030Z"), day + 37230);
  for (const char* bad : {"", "May", "2024-13-01", "2024-02-30", "2024-05-17T1", "2024-05-17T10:20:30 local"})
    EXPECT_FALSE(parse_time(bad)) << bad;
}

}  // namespace
}  // namespace nadir::mosaic

// What a map keeps of its source, read back by GDAL.
#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <cmath>

#include "mosaic/raster_file.h"
#include "nadir/pyramid/build.h"
#include "support/temporary_folder.h"

namespace nadir::pyramid {
namespace {

using mosaic::RasterFile;
using Dataset = std::unique_ptr<GDALDataset>;

class Kept : public testing::Test {
 protected:
  void SetUp() override { GDALAllRegister(); }

  Dataset open(const std::string& path) const { return Dataset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER)); }

  /// The map of a source, whose headers `change` may complete.
  Dataset map_of(const RasterFile& file, const std::function<void(GDALDataset&)>& change = {},
                 const std::function<void(BuildOptions&)>& set = {}) const {
    write(file, source());
    if (change) {
      const Dataset dataset(GDALDataset::Open(source().c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
      change(*dataset);
    }
    BuildOptions o;
    o.sources = {source()};
    o.output = folder_.file("map.tif");
    o.tile_size = 128;
    o.show_progress = false;
    o.force = true;
    if (set) set(o);
    const auto report = build(o);
    if (!report) throw std::runtime_error(report.error().message);
    return open(o.output.string());
  }

  std::string source() const { return folder_.file("source.tif"); }

  const test::TemporaryFolder folder_;
};

TEST_F(Kept, EverySampleOfEveryTypeByEveryCodecThatLosesNothing) {
  using tiff::Predictor;
  for (const GDALDataType type :
       {GDT_Byte, GDT_UInt16, GDT_Int16, GDT_UInt32, GDT_Int32, GDT_UInt64, GDT_Int64, GDT_Float32, GDT_Float64}) {
    RasterFile file{.width = 300, .height = 170, .bands = 2, .type = type};
    const bool signed_type = type != GDT_Byte && type != GDT_UInt16 && type != GDT_UInt32 && type != GDT_UInt64;
    const bool floating = type == GDT_Float32 || type == GDT_Float64;
    file.value = [=](int band, int x, int y) {
      const double value = (x * 7919 + y * 104729 + band * 31) % 251 - (signed_type ? 125 : 0);
      return floating ? value * 0.37 : value;
    };
    for (const Compression codec : {Compression::None, Compression::Deflate, Compression::Zstd, Compression::Lzw,
                                    Compression::Lzma, Compression::Lerc})
      for (const Predictor predictor : {Predictor::None, Predictor::Horizontal, Predictor::FloatingPoint}) {
        const bool stream = codec != Compression::None && codec != Compression::Lerc;
        if (predictor != Predictor::None && !stream) continue;
        if (predictor == Predictor::FloatingPoint && !floating) continue;
        if (codec == Compression::Lerc && GDALGetDataTypeSizeBytes(type) == 8 && !floating) continue;
        const Dataset map = map_of(file, {}, [&](BuildOptions& o) {
          o.compression = codec;
          if (stream) o.predictor = predictor;
        });
        const mosaic::Window all{0, 0, 300, 170};
        EXPECT_TRUE(mosaic::same_samples(mosaic::read_by_gdal(folder_.file("map.tif"), all, {1, 2}).samples,
                                         mosaic::read_by_gdal(source(), all, {1, 2}).samples))
            << GDALGetDataTypeName(type) << " " << to_string(codec) << " " << static_cast<int>(predictor);
      }
  }
}

TEST_F(Kept, ARotatedGridAndPixelIsPoint) {
  RasterFile file;
  file.place = {500000, 0.8, 0.6, 5000000, 0.6, -0.8};
  const Dataset map = map_of(file, [](GDALDataset& d) { d.SetMetadataItem("AREA_OR_POINT", "Point"); });
  std::array<double, 6> place{};
  ASSERT_EQ(map->GetGeoTransform(place.data()), CE_None);
  for (std::size_t i = 0; i < place.size(); ++i) EXPECT_NEAR(place[i], file.place[i], 1e-6);
  EXPECT_STREQ(map->GetMetadataItem("AREA_OR_POINT"), "Point");
}

/// At the corners of 70 x 50 texels, the last of them off the others' grid.
void set_control_points(GDALDataset& d, double off_deg) {
  std::array<GDAL_GCP, 4> points{};
  GDALInitGCPs(4, points.data());
  for (int i = 0; i < 4; ++i) {
    points[static_cast<std::size_t>(i)].dfGCPPixel = i % 2 * 70;
    points[static_cast<std::size_t>(i)].dfGCPLine = i / 2 * 50;
    points[static_cast<std::size_t>(i)].dfGCPX = 10 + i % 2 * 0.7 + (i == 3 ? off_deg : 0);
    points[static_cast<std::size_t>(i)].dfGCPY = 50 - i / 2 * 0.5;
  }
  OGRSpatialReference crs;
  crs.importFromEPSG(4326);
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  d.SetGCPs(4, points.data(), &crs);
  GDALDeinitGCPs(4, points.data());
}

TEST_F(Kept, GroundControlPoints) {
  RasterFile file;
  file.crs = "";
  const Dataset map = map_of(file, [](GDALDataset& d) { set_control_points(d, 0.1); });
  ASSERT_EQ(map->GetGCPCount(), 4);
  EXPECT_DOUBLE_EQ(map->GetGCPs()[3].dfGCPX, 10.8);
  EXPECT_DOUBLE_EQ(map->GetGCPs()[3].dfGCPLine, 50);
  EXPECT_TRUE(map->GetGCPSpatialRef() && map->GetGCPSpatialRef()->IsGeographic());
}

TEST_F(Kept, ThePlaceThatControlPointsOnAGridTell) {
  RasterFile file;
  file.crs = "";
  const Dataset map = map_of(file, [](GDALDataset& d) { set_control_points(d, 0); });
  std::array<double, 6> place{};
  ASSERT_EQ(map->GetGeoTransform(place.data()), CE_None);
  const std::array<double, 6> expected = {10, 0.01, 0, 50, 0, -0.01};
  for (std::size_t i = 0; i < place.size(); ++i) EXPECT_NEAR(place[i], expected[i], 1e-9);
  EXPECT_TRUE(map->GetSpatialRef() && map->GetSpatialRef()->IsGeographic());
}

TEST_F(Kept, RationalPolynomialCoefficients) {
  RasterFile file;
  const Dataset map = map_of(file, [](GDALDataset& d) {
    std::string twenty;
    for (int i = 0; i < 20; ++i) twenty += std::to_string(i) + ".5 ";
    for (const char* name : {"LINE_NUM_COEFF", "LINE_DEN_COEFF", "SAMP_NUM_COEFF", "SAMP_DEN_COEFF"})
      d.SetMetadataItem(name, twenty.c_str(), "RPC");
    for (const char* name : {"LINE_OFF", "SAMP_OFF", "LAT_OFF", "LONG_OFF", "HEIGHT_OFF", "LINE_SCALE", "SAMP_SCALE",
                             "LAT_SCALE", "LONG_SCALE", "HEIGHT_SCALE"})
      d.SetMetadataItem(name, "12.25", "RPC");
  });
  const char* offset = map->GetMetadataItem("LAT_OFF", "RPC");
  ASSERT_TRUE(offset);
  EXPECT_EQ(std::stod(offset), 12.25);
}

TEST_F(Kept, APaletteWithAllItsBits) {
  RasterFile file;
  file.palette = {{0, 0, 0, 255}, {255, 127, 3, 255}, {17, 200, 99, 255}};
  file.value = [](int, int x, int y) { return (x + y) % 3; };
  const Dataset map = map_of(file, {}, [](BuildOptions& o) { o.role = tile::Role::Labels; });
  const GDALColorTable* table = map->GetRasterBand(1)->GetColorTable();
  ASSERT_TRUE(table);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(table->GetColorEntry(i)->c1, file.palette[static_cast<std::size_t>(i)][0]);
    EXPECT_EQ(table->GetColorEntry(i)->c2, file.palette[static_cast<std::size_t>(i)][1]);
    EXPECT_EQ(table->GetColorEntry(i)->c3, file.palette[static_cast<std::size_t>(i)][2]);
  }
  EXPECT_TRUE(map->GetRasterBand(1)->GetOverview(0)->GetColorTable()) << "levels have it too";
}

TEST_F(Kept, StatisticsAreThoseOfWhatIsValid) {
  RasterFile file;
  file.nodata = {7};
  const Dataset map = map_of(file);
  double least = 0, greatest = 0, mean = 0, deviation = 0;
  ASSERT_EQ(map->GetRasterBand(1)->GetStatistics(FALSE, FALSE, &least, &greatest, &mean, &deviation), CE_None);
  const auto texels = mosaic::read_by_gdal(source(), {0, 0, 70, 50}, {1});
  long double sum = 0, squares = 0;
  std::int64_t count = 0;
  for (const double sample : texels.samples)
    if (sample != 7) sum += sample, squares += sample * sample, ++count;
  const double expected = static_cast<double>(sum / count);
  EXPECT_NEAR(mean, expected, 1e-9);
  EXPECT_NEAR(deviation, std::sqrt(static_cast<double>(squares / count) - expected * expected), 1e-6);
  EXPECT_EQ(least, 0);
  EXPECT_EQ(greatest, 119);
}

TEST_F(Kept, NodataOfEveryTypeAtItsLimits) {
  const std::pair<GDALDataType, double> limits[] = {{GDT_Byte, 255},
                                                    {GDT_Int16, -32768},
                                                    {GDT_UInt16, 65535},
                                                    {GDT_Int32, -2147483648.0},
                                                    {GDT_UInt32, 4294967295.0},
                                                    {GDT_Float32, -9999},
                                                    {GDT_Float64, -1.7976931348623157e308}};
  for (const auto& [type, nodata] : limits) {
    RasterFile file{.type = type, .nodata = {nodata}};
    const Dataset map = map_of(file);
    int has = 0;
    EXPECT_EQ(map->GetRasterBand(1)->GetNoDataValue(&has), nodata) << GDALGetDataTypeName(type);
    EXPECT_TRUE(has);
  }
}

}  // namespace
}  // namespace nadir::pyramid

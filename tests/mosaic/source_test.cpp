#include "nadir/mosaic/source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "mosaic/raster_file.h"
#include "support/temporary_folder.h"

namespace nadir::mosaic {
namespace {

using test::TemporaryFolder;
using Strings = std::vector<std::string>;

Sources open_one(const std::string& path) {
  SourceOptions options;
  options.names = {path};
  auto sources = open_sources(options);
  EXPECT_TRUE(sources) << sources.error().message;
  return sources ? *sources : Sources{};
}

/// All windows of a file, against GDAL: samples always, validity where it lies beside them.
void expect_as_gdal_reads(const std::string& path) {
  const Sources sources = open_one(path);
  ASSERT_EQ(sources.rasters.size(), 1u);
  const Source& source = *sources.rasters.front();
  std::vector<int> bands = source.description().data_bands();
  for (int b = 1; b <= sources.type.bands; ++b)
    if (source.description().bands[static_cast<std::size_t>(b) - 1].color == "Alpha") bands.push_back(b);
  for (const Window& window : windows_of(source.width(), source.height())) {
    Block block(sources.type, window);
    const auto read = source.read(block);
    ASSERT_TRUE(read) << read.error().message;
    const GdalTexels expected = read_by_gdal(path, window, bands);
    EXPECT_TRUE(same_samples(samples_of(block, sources.type), expected.samples))
        << path << ": window " << window.x << ", " << window.y << " of " << window.width << " x " << window.height;
    if (sources.type.mask) {
      EXPECT_EQ(validity_of(block), expected.valid) << path;
    }
  }
}

struct Layout {
  const char* name;
  Strings options;
  bool plain;  // without a codec
};

const std::vector<Layout> layouts = {
    {"strips", {"BLOCKYSIZE=7"}, true},
    {"one_strip", {"BLOCKYSIZE=50"}, true},
    {"tiles", {"TILED=YES", "BLOCKXSIZE=32", "BLOCKYSIZE=16"}, true},
    {"strips_apart", {"BLOCKYSIZE=7", "INTERLEAVE=BAND"}, true},
    {"tiles_apart", {"TILED=YES", "BLOCKXSIZE=32", "BLOCKYSIZE=16", "INTERLEAVE=BAND"}, true},
    {"strips_deflate", {"BLOCKYSIZE=7", "COMPRESS=DEFLATE", "PREDICTOR=2"}, false},
    {"tiles_lzw", {"TILED=YES", "BLOCKXSIZE=16", "BLOCKYSIZE=32", "COMPRESS=LZW"}, false},
    {"tiles_apart_zstd", {"TILED=YES", "BLOCKXSIZE=32", "BLOCKYSIZE=32", "INTERLEAVE=BAND", "COMPRESS=ZSTD"}, false},
    {"strips_apart_lzma", {"BLOCKYSIZE=7", "INTERLEAVE=BAND", "COMPRESS=LZMA"}, false},
    {"strips_packbits", {"BLOCKYSIZE=7", "COMPRESS=PACKBITS"}, false},  // by GDAL
};

class Reads : public testing::TestWithParam<std::tuple<std::size_t, const char*, GDALDataType>> {};

TEST_P(Reads, WhatGdalReads) {
  const auto& [index, order, type] = GetParam();
  const Layout& layout = layouts[index];
  const bool integer_of_8_to_64 = type != GDT_Float32 && type != GDT_Float64;
  const TemporaryFolder folder;
  for (const int bands : {1, 3, 4, 5}) {
    RasterFile file;
    file.bands = bands;
    file.type = type;
    file.options = layout.options;
    file.options.push_back(std::string("ENDIANNESS=") + order);
    if (!integer_of_8_to_64) std::erase(file.options, "PREDICTOR=2");
    if (bands == 3) file.options.push_back("PHOTOMETRIC=RGB");
    if (bands == 4) file.options.push_back("ALPHA=YES");
    const std::string path = folder.file("source.tif");
    write(file, path);
    expect_as_gdal_reads(path);
    const Sources sources = open_one(path);
    EXPECT_EQ(sources.type.alpha, bands == 4);
    EXPECT_FALSE(sources.type.mask);
    const bool native = type == GDT_Byte || std::string_view(order) == "LITTLE";
    EXPECT_EQ(sources.rasters.front()->plain(), layout.plain && native) << layout.name << ' ' << bands;
  }
}

INSTANTIATE_TEST_SUITE_P(Layouts, Reads,
                         testing::Combine(testing::Range(std::size_t{0}, layouts.size()),
                                          testing::Values("LITTLE", "BIG"),
                                          testing::Values(GDT_Byte, GDT_UInt16, GDT_Int16, GDT_UInt32, GDT_Int32,
                                                          GDT_Int64, GDT_Float32, GDT_Float64)),
                         [](const auto& test) {
                           return std::string(layouts[std::get<0>(test.param)].name) + "_" + std::get<1>(test.param) +
                                  "_" + GDALGetDataTypeName(std::get<2>(test.param));
                         });

TEST(Reads, MasksOfEveryLayoutAsGdalDoes) {
  const TemporaryFolder folder;
  for (const Layout& layout : layouts)
    for (const bool external : {false, true}) {
      RasterFile file;
      file.width = 300;  // mask strips are higher than those of imagery
      file.height = 90;
      file.bands = 3;
      file.options = layout.options;
      file.mask = true;
      file.external_mask = external;
      const std::string path = folder.file(std::string(layout.name) + (external ? "_external.tif" : ".tif"));
      write(file, path);
      ASSERT_TRUE(open_one(path).type.mask) << path;
      expect_as_gdal_reads(path);
    }
}

TEST(Reads, JpegWebpAndLercInStripsAndTilesAsGdalDoes) {
  const TemporaryFolder folder;
  int number = 0;
  for (const char* codec : {"JPEG", "WEBP", "LERC", "LERC_ZSTD"})
    for (const Strings& layout : {Strings{"BLOCKYSIZE=16"}, Strings{"TILED=YES", "BLOCKXSIZE=32", "BLOCKYSIZE=32"}}) {
      RasterFile file;
      file.bands = 3;
      file.options = layout;
      file.options.push_back(std::string("COMPRESS=") + codec);
      if (std::string_view(codec) == "JPEG") file.options.push_back("PHOTOMETRIC=YCBCR");
      const std::string path = folder.file(std::to_string(number++) + ".tif");
      write(file, path);
      expect_as_gdal_reads(path);
    }
}

TEST(Reads, OtherFormatsAsGdalDoes) {
  const TemporaryFolder folder;
  for (const auto& [driver, extension] :
       {std::pair("PNG", "png"), std::pair("JPEG", "jpg"), std::pair("HFA", "img"), std::pair("ENVI", "img")}) {
    RasterFile file;
    file.bands = 3;
    file.width = 700;
    file.height = 600;
    file.driver = driver;
    const std::string path = folder.file(std::string(driver) + "." + extension);
    write(file, path);
    expect_as_gdal_reads(path);
  }
}

TEST(Reads, WhatWasNeverWrittenAsNodataOrZero) {
  const TemporaryFolder folder;
  for (const Layout& layout : layouts)
    for (const bool with_nodata : {false, true}) {
      RasterFile file;
      file.bands = 2;
      file.type = GDT_Int16;
      file.options = layout.options;
      file.options.push_back("SPARSE_OK=YES");
      file.unwritten = true;
      if (with_nodata) file.nodata = {-7.0, -7.0};
      const std::string path = folder.file(std::string(layout.name) + (with_nodata ? "_nodata.tif" : ".tif"));
      write(file, path);
      expect_as_gdal_reads(path);
    }
}

TEST(Reads, ASignedByteAsWhatItIs) {
  const TemporaryFolder folder;
  for (const char* compression : {"NONE", "DEFLATE", "PACKBITS"}) {
    RasterFile file;
    file.options = {"PIXELTYPE=SIGNEDBYTE", std::string("COMPRESS=") + compression};
    file.value = [](int, int x, int y) { return (x * 5 + y * 3) % 256; };
    const std::string path = folder.file(std::string(compression) + ".tif");
    write(file, path);
    const Sources sources = open_one(path);
    ASSERT_EQ(sources.type.sample, Sample::I8);
    Block block(sources.type, {0, 0, 70, 50});
    ASSERT_TRUE(sources.rasters.front()->read(block));
    const auto samples = samples_of(block, sources.type);
    for (std::size_t i = 0; i < samples.size(); ++i)
      ASSERT_EQ(samples[i], static_cast<std::int8_t>(static_cast<int>(i % 70 * 5 + i / 70 * 3) % 256));
  }
}

TEST(Reads, ComplexSamplesAsMagnitudes) {
  const TemporaryFolder folder;
  RasterFile file;
  file.type = GDT_CFloat32;
  const std::string path = folder.file("complex.tif");
  write(file, path);
  {  // 3 + 4i in one texel
    const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(path.c_str(), GDAL_OF_UPDATE));
    float value[2] = {-3, 4};
    ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Write, 6, 9, 1, 1, value, 1, 1, GDT_CFloat32, 0, 0, nullptr),
              CE_None);
  }
  const Sources sources = open_one(path);
  EXPECT_EQ(sources.type.sample, Sample::F32);
  ASSERT_EQ(sources.warnings.size(), 1u);
  EXPECT_NE(sources.warnings[0].find("magnitude"), std::string::npos);
  Block block(sources.type, {6, 9, 1, 1});
  ASSERT_TRUE(sources.rasters.front()->read(block));
  EXPECT_EQ(samples_of(block, sources.type), std::vector<double>{5});
}

TEST(Reads, APlainFileAtTheCostOfItsBytes) {
  const TemporaryFolder folder;
  RasterFile file;
  write(file, folder.file("plain.tif"));
  const Sources sources = open_one(folder.file("plain.tif"));
  Block block(sources.type, {0, 0, 70, 50});
  ASSERT_TRUE(sources.rasters.front()->read(block));
  EXPECT_TRUE(sources.rasters.front()->plain());
  EXPECT_EQ(sources.rasters.front()->blocks_decoded(), 0);
}

TEST(DamagedSource, SaysWhichFileAndWhere) {
  const TemporaryFolder folder;
  for (const char* compression : {"NONE", "DEFLATE", "PACKBITS"}) {
    RasterFile file;
    file.options = {"BLOCKYSIZE=7", std::string("COMPRESS=") + compression};
    file.value = [](int, int x, int y) { return (x * x * 31 + y * y * 17 + x * y) % 251; };
    const std::string path = folder.file(std::string(compression) + ".tif");
    write(file, path);
    const auto place = [&](const char* what) {
      const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(path.c_str()));
      return std::stoul(dataset->GetRasterBand(1)->GetMetadataItem(what, "TIFF"));
    };
    std::string bytes = test::bytes_of(path);
    if (std::string_view(compression) == "NONE")  // its last strip lies at the end
      bytes.resize(place("BLOCK_OFFSET_0_7") + 5);
    else
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(place("BLOCK_OFFSET_0_7")), place("BLOCK_SIZE_0_7"),
                  '\x80');
    std::ofstream(path, std::ios::binary) << bytes;
    SourceOptions options;
    options.names = {path};
    const auto sources = open_sources(options);
    ASSERT_TRUE(sources) << sources.error().message;
    Block last(sources->type, {0, 49, 70, 1}), first(sources->type, {0, 0, 70, 7});
    const auto read = sources->rasters.front()->read(last);
    ASSERT_FALSE(read) << compression;
    EXPECT_EQ(read.error().kind, Error::Kind::Damaged);
    // GDAL reads more at once than it stores in one strip.
    const bool by_gdal = std::string_view(compression) == "PACKBITS";
    EXPECT_TRUE(read.error().message.starts_with(path + ": texels 0 to 70 by " + (by_gdal ? "0" : "49") + " to 50"))
        << read.error().message;
    EXPECT_NE(read.error().message.find("again"), std::string::npos) << read.error().message;
    EXPECT_TRUE(by_gdal || sources->rasters.front()->read(first)) << "what is whole stays readable";
  }
}

TEST(Description, TellsControlPointsFromPlacesThatAreMissing) {
  const Sources points = open_one(NADIR_SOURCE_DIR "/tests/data/awkward/gcp_rpc__byte_gcp.tif");
  EXPECT_FALSE(points.rasters.front()->description().georeference);
  EXPECT_NE(points.rasters.front()->description().georeference_problem.find("control points"), std::string::npos);
  const Sources nowhere = open_one(NADIR_SOURCE_DIR "/tests/data/awkward/geotransform__byte_nogeoref.tif");
  EXPECT_NE(nowhere.rasters.front()->description().georeference_problem.find("geotransform"), std::string::npos);
}

}  // namespace
}  // namespace nadir::mosaic

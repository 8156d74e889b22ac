#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "nadir/tile/cell_source.h"
#include "nadir/tile/map.h"
#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

// Odd and damaged files of other people's test suites (tests/data/README.md tells whose). Each is either read right or
// refused with a message about what is wrong with it; GDAL prints nothing.
namespace nadir::tile {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr const char* folder_of_files = NADIR_SOURCE_DIR "/tests/data/awkward/";

/// The file, or a copy of it with a georeference beside it, so that one without its own comes to be read too.
std::string placed(const TemporaryFolder& folder, const std::string& file, bool has_own_place) {
  if (has_own_place) return folder_of_files + file;
  fs::copy_file(folder_of_files + file, folder.file(file));
  folder.write(file + ".aux.xml", R"(<PAMDataset><SRS dataAxisToSRSAxisMapping="1,2">EPSG:32614</SRS>)"
                                  "<GeoTransform>500000, 0.01, 0, 5205000, 0, -0.01</GeoTransform></PAMDataset>");
  return folder.file(file);
}

/// Opens a map and decodes all of it, as a renderer would; the texels of all data bands of level 0.
Result<Texels> read_all(const std::string& path) {
  const auto map = Map::open(path);
  if (!map) return fail(map);
  const auto source = CellSource::make(*map, {}, Domain::Linear);
  if (!source) return fail(source);
  if (const auto cells = (*source)->load((*source)->block_of(0, 0, 0)); !cells) return fail(cells);
  return map->read(0, {0, 0, map->width(), map->height()}, (*source)->bands());
}

/// Runs `f`, and fails if anything is printed meanwhile.
template <class F>
auto silently(F&& f) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  auto result = f();
  EXPECT_EQ(testing::internal::GetCapturedStderr() + testing::internal::GetCapturedStdout(), "");
  return result;
}

struct Right {
  const char* file;
  bool has_own_place;
  int x, y;
  std::vector<double>
      samples;  // of that texel as GDAL's Python bindings read it; none where its nodata or mask makes it invalid
};
std::ostream& operator<<(std::ostream& out, const Right& r) { return out << r.file; }

class ReadRight : public testing::TestWithParam<Right> {};

TEST_P(ReadRight, TheTexelIsWhatGdalReads) {
  const TemporaryFolder folder;
  const Right& expected = GetParam();
  const std::string path = placed(folder, expected.file, expected.has_own_place);
  const auto texels = silently([&] { return read_all(path); });
  ASSERT_TRUE(texels) << texels.error().message;
  const auto at = static_cast<std::size_t>(expected.y) * static_cast<std::size_t>(texels->window.width) +
                  static_cast<std::size_t>(expected.x);
  const bool valid = texels->validity.empty() || texels->validity[at];
  ASSERT_EQ(valid, !expected.samples.empty());
  if (!valid) return;
  std::vector<double> samples;
  with_sample_type(texels->type, [&]<class T>(T) {
    const T* first = reinterpret_cast<const T*>(texels->samples.data()) + at * static_cast<std::size_t>(texels->bands);
    samples.assign(first, first + texels->bands);
  });
  EXPECT_EQ(samples, expected.samples);
}

INSTANTIATE_TEST_SUITE_P(
    Awkward, ReadRight,
    testing::Values(
        Right{"nodata__nodata_byte.tif", true, 13, 6, {99}}, Right{"nodata__nan32_nodata.tif", true, 6, 3, {56}},
        Right{"nodata__float32_with_nodata_slightly_above_float_max.tif", false, 66, 0, {}},
        Right{"nodata__stats_nodata_neginf.tif", false, 2, 0, {-2}},
        Right{"nodata__stats_nodata_neginf.tif", false, 0, 0, {}}, Right{"nodata__float_nan.tif", false, 2, 0, {}},
        // Alpha is validity, not a sample.
        Right{"alpha_mask__rgba.tif", true, 13, 6, {255, 0, 0}},
        Right{"alpha_mask__rgba_with_alpha_0_and_255.tif", true, 1, 0, {255, 255, 255}},
        // Three bands, each with a mask of its own
        Right{"alpha_mask__test3_with_mask_8bit.tif", false, 13, 6, {127, 127, 127}},
        Right{"alpha_mask__test3_with_mask_8bit.tif", false, 0, 0, {}},
        Right{"bit_depth__int12.tif", true, 13, 6, {99}}, Right{"bit_depth__float16.tif", true, 13, 6, {99}},
        Right{"bit_depth__int24.tif", true, 13, 6, {99}}, Right{"bit_depth__int64_full_range.tif", false, 1, 0, {1e10}},
        Right{"bigtiff__byte_bigtiff_strip5lines.tif", true, 13, 6, {99}},
        Right{"endian__int16_big_endian.tif", true, 13, 6, {99}},
        Right{"endian__float32_lzw_predictor_3_big_endian.tif", true, 13, 6, {99}},
        Right{"pixel_is_point__byte_point.tif", true, 13, 6, {99}},
        Right{"layout__separate_tiled.tif", false, 23, 12, {35, 35, 35}},
        Right{"layout__rgbsmall_DEFLATE_tiled_separate.tif", true, 33, 16, {69, 98, 14}},
        Right{"sparse__sparse_tiled_contig.tif", false, 26, 7, {}}, Right{"codec__byte_zstd.tif", true, 13, 6, {99}},
        Right{"ycbcr_jpeg__rgbsmall_JPEG_ycbcr.tif", true, 33, 16, {85, 107, 32}},
        Right{"ycbcr_jpeg__rgbsmall_cmyk.tif", false, 33, 16, {47, 98, 0}},
        Right{"palette__test_average_palette.tif", false, 13, 6, {1}},
        Right{"crs__epsg_2853_with_us_feet.tif", true, 13, 6, {99}},
        Right{"geotransform__geomatrix.tif", true, 13, 6, {99}},
        Right{"geotransform__negative_scaley.tif", true, 0, 0, {107}},
        Right{"scale_offset__tiff_vertcs_scale_offset.tif", true, 0, 0, {107}}));

TEST(AwkwardPlaces, FeetPointsAndRotationsAreWhereTheySay) {
  // A quarter of a US survey foot, 1200 / 3937 m; Virginia North is conformal, true to scale within 1e-4.
  const Map feet = Map::open(std::string(folder_of_files) + "crs__epsg_2853_with_us_feet.tif").value();
  EXPECT_NEAR(feet.texel_size_m().x(), 0.25 * 1200 / 3937, 1e-4 * 0.25);
  // The tie point (440720, 3751320) belongs to the centre of the first texel of 60 m, not to its corner.
  const Map point = Map::open(std::string(folder_of_files) + "pixel_is_point__byte_point.tif").value();
  EXPECT_TRUE((point.crs_from_texel() * Eigen::Vector2d(0.5, 0.5)).isApprox(Eigen::Vector2d(440720, 3751320)));
  // Columns run along (1.5, -5), rows along (-5, -1.5).
  const Map rotated = Map::open(std::string(folder_of_files) + "geotransform__geomatrix.tif").value();
  EXPECT_TRUE((rotated.crs_from_texel().linear() * Eigen::Vector2d(1, 0)).isApprox(Eigen::Vector2d(1.5, -5)));
  EXPECT_TRUE((rotated.crs_from_texel().linear() * Eigen::Vector2d(0, 1)).isApprox(Eigen::Vector2d(-5, -1.5)));
}

struct Refused {
  const char* file;
  bool has_own_place;
  const char* because;  // words of the message
};
std::ostream& operator<<(std::ostream& out, const Refused& r) { return out << r.file; }

class ReadRefused : public testing::TestWithParam<Refused> {};

TEST_P(ReadRefused, TheMessageSaysWhichFileWhatAndWhatToDo) {
  const TemporaryFolder folder;
  const Refused& expected = GetParam();
  const std::string path = placed(folder, expected.file, expected.has_own_place);
  const auto texels = silently([&] { return read_all(path); });
  ASSERT_FALSE(texels);
  const std::string& message = texels.error().message;
  EXPECT_TRUE(message.starts_with(path)) << message;
  EXPECT_EQ(message.find(path, 1), std::string::npos) << "the path once: " << message;
  EXPECT_NE(message.find(expected.because), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << "one line: " << message;
  EXPECT_LT(message.size(), path.size() + 350) << message;
}

constexpr const char* fetch_again = "fetch it again";
constexpr const char* fetch_or_build = "fetch or build it again";
INSTANTIATE_TEST_SUITE_P(Awkward, ReadRefused,
                         testing::Values(  // not to be opened at all
                             Refused{"bit_depth__uint33.tif", true, "33"},
                             Refused{"codec__unknown_compression.tif", true, "codec"},
                             Refused{"corrupt__toomanyblocks.tif", true, fetch_again},
                             Refused{"corrupt__hugeblocksize.tif", true, fetch_again},
                             Refused{"corrupt__image_width_above_32bit.tif", true, fetch_again},
                             Refused{"corrupt__fuzz_oom_crash_32.tif", true, fetch_again},
                             Refused{"corrupt__fuzz_divide_by_zero_06.tif", true, fetch_again},
                             Refused{"corrupt__fuzz_oor_panic_64.tif", true, fetch_again},
                             // not to be placed
                             Refused{"gcp_rpc__byte_gcp.tif", true, "gdalwarp"},
                             Refused{"gcp_rpc__byte_rpc.tif", true, "gdalwarp -rpc"},
                             Refused{"geotransform__byte_nogeoref.tif", true, "-a_ullr"},
                             Refused{"geotransform__rotated.tif", true, "-a_srs"},
                             // not to be rendered
                             Refused{"complex__cint16.tif", true, "magnitude"},
                             // damaged headers, though GDAL would go on with zeros
                             Refused{"corrupt__fuzz_oom_crash_54.tif", false, "StripOffsets"},
                             Refused{"corrupt__fuzz_inf_loop_28.tif", false, fetch_or_build},
                             // damaged tiles
                             Refused{"corrupt__byte_truncated.tif", true, "level 0, texels 0 to 20 by 0 to 20"},
                             Refused{"corrupt__byte_zstd_corrupted.tif", true, "ZSTD"},
                             Refused{"corrupt__lzw_corrupted.tif", false, fetch_or_build},
                             Refused{"corrupt__tiled_bad_offset.tif", false, fetch_or_build},
                             Refused{"corrupt__excessive-memory-TIFFFillStrip.tif", false, "strip byte count"},
                             Refused{"corrupt__many_blocks_truncated.tif", false, "texels 0 to 1 by 0 to 128"},
                             Refused{"corrupt__huge-number-strips.tif", false, "level 0"},
                             Refused{"corrupt__corrupted_gtiff_tags.tif", false, fetch_or_build}));

TEST(Open, RefusesOtherBodiesThanTheEarth) {
  const TemporaryFolder folder;
  test::SyntheticMap mars;
  mars.crs = "+proj=eqc +lat_ts=-10 +a=3395582.027 +b=3395582.027 +units=m +type=crs";
  mars.geotransform = {1000, 10, 0, 1000, 0, -10};
  mars.value = [](int, int, int, int) { return 1; };
  test::write_map(mars, folder.file("mars.tif"));
  const auto opened = silently([&] { return Map::open(folder.file("mars.tif")); });
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().message.find("3395582 m"), std::string::npos) << opened.error().message;
  EXPECT_LT(opened.error().message.size(), 300u) << opened.error().message;
}

class CutShort : public testing::TestWithParam<const char*> {};

TEST_P(CutShort, AFileOfAnyLengthIsAnErrorOrRight) {
  const TemporaryFolder folder;
  const std::string original = std::string(folder_of_files) + GetParam();
  const std::string whole = test::bytes_of(original);
  const Texels right = read_all(original).value();
  std::size_t refused = 0;
  const auto cut = [&](std::size_t length) {
    const std::string path = folder.file("cut.tif");
    std::ofstream(path, std::ios::binary) << whole.substr(0, length);
    const auto texels = read_all(path);
    refused += !texels;
    return !texels || (texels->samples == right.samples && texels->validity == right.validity);
  };
  std::vector<std::size_t> wrong;
  silently([&] {
    for (std::size_t length = 0; length < whole.size(); ++length)
      if (!cut(length)) wrong.push_back(length);
    return 0;
  });
  EXPECT_EQ(wrong, std::vector<std::size_t>{}) << "lengths in bytes that gave another picture";
  EXPECT_GT(refused, whole.size() / 2) << "these files no longer need their bytes";
}
// Compressed by zstd in a strip, by LZW with big-endian floats, and by JPEG, of which libjpeg makes up what is missing.
INSTANTIATE_TEST_SUITE_P(Awkward, CutShort,
                         testing::Values("codec__byte_zstd.tif", "endian__float32_lzw_predictor_3_big_endian.tif",
                                         "ycbcr_jpeg__rgbsmall_JPEG_ycbcr.tif"));

/// A copy of a file in which the second half of the bytes of its first tile are 0xff 0xd9, JPEG's end of an image.
std::string with_damaged_tile(const TemporaryFolder& folder, const std::string& original) {
  std::size_t offset = 0, size = 0;
  {
    GDALAllRegister();
    const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(original.c_str()));
    offset = std::stoul(dataset->GetRasterBand(1)->GetMetadataItem("BLOCK_OFFSET_0_0", "TIFF"));
    size = std::stoul(dataset->GetRasterBand(1)->GetMetadataItem("BLOCK_SIZE_0_0", "TIFF"));
  }
  std::string bytes = test::bytes_of(original);
  for (std::size_t i = size / 2; i < size; ++i) bytes[offset + i] = static_cast<char>(i % 2 ? 0xd9 : 0xff);
  std::ofstream(folder.file("damaged.tif"), std::ios::binary) << bytes;
  return folder.file("damaged.tif");
}

TEST(DamagedTile, AJpegThatEndsEarlyIsNoPicture) {
  const TemporaryFolder folder;
  const std::string path =
      with_damaged_tile(folder, std::string(folder_of_files) + "ycbcr_jpeg__rgbsmall_JPEG_ycbcr.tif");
  const auto texels = silently([&] { return read_all(path); });
  ASSERT_FALSE(texels);
  EXPECT_NE(texels.error().message.find("level 0"), std::string::npos) << texels.error().message;
}

TEST(DamagedTile, TellsItsLevelPlaceAndCauseAndTheOthersAreRead) {
  const TemporaryFolder folder;
  const std::string path =
      with_damaged_tile(folder, std::string(folder_of_files) + "layout__rgbsmall_DEFLATE_tiled_separate.tif");
  const auto texels = silently([&] { return read_all(path); });
  ASSERT_FALSE(texels);
  EXPECT_EQ(texels.error().kind, Error::Kind::Damaged);
  EXPECT_NE(texels.error().message.find("level 0, tile (0, 0): DEFLATE data are damaged"), std::string::npos)
      << texels.error().message;
  const auto map = Map::open(path).value();
  const std::array bands = {1, 2, 3};
  EXPECT_TRUE(map.read(0, {map.width() - 1, map.height() - 1, 1, 1}, bands));
}

TEST(DamagedTile, GdalsOwnThreadsPrintNothingAndLoseNoCause) {
  const TemporaryFolder folder;
  {  // in tiles that no cells make up, which GDAL reads
    GDALDriver* driver = (GDALAllRegister(), GetGDALDriverManager()->GetDriverByName("GTiff"));
    const char* const options[] = {"TILED=YES", "BLOCKXSIZE=48", "BLOCKYSIZE=48", "COMPRESS=DEFLATE", nullptr};
    const std::unique_ptr<GDALDataset> dataset(
        driver->Create(folder.file("whole.tif").c_str(), 200, 200, 1, GDT_Byte, const_cast<char**>(options)));
    OGRSpatialReference srs;
    srs.importFromEPSG(32614);
    dataset->SetSpatialRef(&srs);
    std::array<double, 6> place = {500000, 1, 0, 5000000, 0, -1};
    dataset->SetGeoTransform(place.data());
    std::vector<std::uint8_t> row(200);
    for (int y = 0; y < 200; ++y) {
      for (int x = 0; x < 200; ++x) row[static_cast<std::size_t>(x)] = static_cast<std::uint8_t>(x * x + y * 31);
      ASSERT_EQ(
          dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, y, 200, 1, row.data(), 200, 1, GDT_Byte, 0, 0, nullptr),
          CE_None);
    }
  }
  const std::string path = with_damaged_tile(folder, folder.file("whole.tif"));
  CPLSetConfigOption("GDAL_NUM_THREADS", "4");
  const auto texels = silently([&] { return read_all(path); });
  CPLSetConfigOption("GDAL_NUM_THREADS", nullptr);
  ASSERT_FALSE(texels);
  EXPECT_NE(texels.error().message.find("ZIPDecode"), std::string::npos) << texels.error().message;
}

}  // namespace
}  // namespace nadir::tile

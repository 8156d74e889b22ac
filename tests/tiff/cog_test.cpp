#include "nadir/tiff/cog.h"

#include <cpl_error.h>
#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "cog_file.h"
#include "nadir/base/byte_source.h"
#include "nadir/tiff/tiff_file.h"
#include "support/temporary_folder.h"

namespace nadir::tiff {
namespace {
using namespace test;
using Dataset = std::unique_ptr<GDALDataset>;

/// 300 x 200 texels halved down to one: 5 x 4 tiles of 64, with partial ones on both sides, to a part of a single one.
const std::vector<CogLevel> to_one_texel = {{300, 200}, {150, 100}, {75, 50}, {37, 25}, {18, 12},
                                            {9, 6},     {4, 3},     {2, 1},   {1, 1}};

/// Fails the test for whatever GDAL has to say meanwhile.
class Silence {
 public:
  Silence() { CPLPushErrorHandler(&complain); }
  ~Silence() { CPLPopErrorHandler(); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  static void CPL_STDCALL complain(CPLErr severity, CPLErrorNum, const char* message) {
    if (severity != CE_Debug) ADD_FAILURE() << "GDAL says: " << message;
  }
};

Dataset open(const std::string& path) {
  return Dataset{static_cast<GDALDataset*>(GDALOpen(path.c_str(), GA_ReadOnly))};
}

std::vector<double> samples_of(GDALRasterBand& band) {
  const int width = band.GetXSize(), height = band.GetYSize();
  std::vector<double> samples(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  EXPECT_EQ(band.RasterIO(GF_Read, 0, 0, width, height, samples.data(), width, height, GDT_Float64, 0, 0, nullptr),
            CE_None);
  return samples;
}

/// GDAL reads every sample and mask of every level as it was written, and says nothing.
void expect_gdal_reads(const std::string& path, const CogShape& shape) {
  const Silence silence;
  const Dataset file = open(path);
  ASSERT_TRUE(file) << path;
  ASSERT_EQ(file->GetRasterCount(), static_cast<int>(shape.format.samples));
  const std::uint32_t side = shape.format.tile_width;
  for (std::uint32_t b = 0; b < shape.format.samples; ++b) {
    GDALRasterBand* full = file->GetRasterBand(static_cast<int>(b) + 1);
    ASSERT_EQ(full->GetOverviewCount(), static_cast<int>(shape.levels.size()) - 1);
    for (std::size_t level = 0; level < shape.levels.size(); ++level) {
      GDALRasterBand* band = level == 0 ? full : full->GetOverview(static_cast<int>(level) - 1);
      const CogLevel size = shape.levels[level];
      ASSERT_EQ(band->GetXSize(), static_cast<int>(size.width));
      ASSERT_EQ(band->GetYSize(), static_cast<int>(size.height));
      const auto samples = samples_of(*band);
      if (shape.mask) {
        ASSERT_EQ(band->GetMaskFlags(), GMF_PER_DATASET) << "level " << level;
      }
      const auto mask = shape.mask ? samples_of(*band->GetMaskBand()) : std::vector<double>(samples.size());
      for (std::uint32_t y = 0, i = 0; y < size.height; ++y)
        for (std::uint32_t x = 0; x < size.width; ++x, ++i) {
          const std::size_t tile = std::size_t{y / side} * ((size.width + side - 1) / side) + x / side;
          const bool empty = shape.empty && shape.empty(level, tile);
          const double expected = empty ? 0 : expected_sample(shape, level, x, y, b);
          // GDAL before 3.7 knows no signed bytes
          const bool as_unsigned = expected < 0 && band->GetRasterDataType() == GDT_Byte;
          ASSERT_EQ(samples[i], as_unsigned ? expected + 256 : expected)
              << path << ", level " << level << ", band " << b << ", texel " << x << " " << y;
          if (shape.mask) {
            ASSERT_EQ(mask[i], !empty && expected_valid(level, x, y) ? 255 : 0);
          }
        }
    }
  }
}

class Cog : public testing::Test {
 protected:
  void SetUp() override { GDALAllRegister(); }
  std::string path(const std::string& name) const { return folder_.file(name); }

  /// Whether GDAL's own check, tile for tile, finds nothing to complain of in all files of the folder.
  void expect_valid() const {
    if (std::system("/usr/bin/python3 -c 'import osgeo_utils' 2>/dev/null") != 0)
      GTEST_SKIP() << "needs GDAL's Python scripts";
    const std::string script = folder_.write("check.py", R"(
import glob, sys
from osgeo import gdal
from osgeo_utils.samples.validate_cloud_optimized_geotiff import validate
said = []
gdal.PushErrorHandler(lambda kind, number, message: said.append(message))
names = glob.glob(sys.argv[1] + '/*.tif')
for name in names:
    warnings, errors, details = validate(gdal.Open(name), full_check=True)
    said += [name + ': ' + text for text in warnings + errors]
    layout = gdal.Open(name).GetMetadataItem('LAYOUT', 'IMAGE_STRUCTURE')
    if layout != 'COG': said.append(name + ': layout ' + str(layout))
print('\n'.join(said))
sys.exit(1 if said or not names else 0)
)");
    EXPECT_EQ(std::system(("/usr/bin/python3 " + script + " " + folder_.path().string()).c_str()), 0);
  }

  nadir::test::TemporaryFolder folder_;
};

TEST_F(Cog, EveryKindOfSampleIsReadByGdalAndPassesItsCheck) {
  std::vector<CogShape> shapes = {
      {tile_format(64, 1, 8, Number::Unsigned), to_one_texel},
      {tile_format(64, 3, 8, Number::Unsigned), to_one_texel},
      {tile_format(64, 4, 8, Number::Unsigned), to_one_texel, {2}},
      {tile_format(64, 11, 16, Number::Unsigned), to_one_texel, std::vector<std::uint16_t>(10)},
      {tile_format(64, 2, 32, Number::Float), to_one_texel, {0}},
      {tile_format(64, 1, 8, Number::Signed), to_one_texel},
      {tile_format(64, 1, 16, Number::Signed), to_one_texel},
      {tile_format(64, 1, 64, Number::Unsigned), to_one_texel},
      {tile_format(64, 1, 64, Number::Float), to_one_texel}};
  shapes[1].format.photometric = shapes[2].format.photometric = Photometric::Rgb;
  const std::size_t plain = shapes.size();
  for (std::size_t i = 0; i < plain; ++i) {
    CogShape deflate = shapes[i];
    deflate.format.codec = Codec::Deflate;
    deflate.mask = deflate.extra_samples != std::vector<std::uint16_t>{2};
    deflate.losses = true;
    shapes.push_back(deflate);
  }
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const std::string file = path("kind" + std::to_string(i) + ".tif");
    EXPECT_FALSE(write_cog(file, shapes[i]).big);
    expect_gdal_reads(file, shapes[i]);
  }
  expect_valid();
}

TEST_F(Cog, TheLastOfFourBandsIsOpacityOnlyWhereItIsSaidToBe) {
  CogShape shape{tile_format(64, 4, 8, Number::Unsigned), {{64, 64}}, {2}};
  shape.format.photometric = Photometric::Rgb;
  write_cog(path("alpha.tif"), shape);
  shape.extra_samples = {0};
  write_cog(path("infrared.tif"), shape);
  EXPECT_EQ(open(path("alpha.tif"))->GetRasterBand(4)->GetColorInterpretation(), GCI_AlphaBand);
  EXPECT_NE(open(path("infrared.tif"))->GetRasterBand(4)->GetColorInterpretation(), GCI_AlphaBand);
}

TEST_F(Cog, BandsMayLieInTilesOfTheirOwn) {
  for (const Number number : {Number::Unsigned, Number::Float}) {
    CogShape shape{tile_format(64, 3, number == Number::Float ? 64 : 8, number), to_one_texel};
    shape.format.separate = true;
    shape.extra_samples = {0, 0};
    shape.empty = [](std::size_t level, std::size_t tile) { return level == 0 && tile == 3; };
    const std::string file = path(number == Number::Float ? "floats.tif" : "bytes.tif");
    write_cog(file, shape);
    expect_gdal_reads(file, shape);
    EXPECT_STREQ(open(file)->GetMetadataItem("INTERLEAVE", "IMAGE_STRUCTURE"), "BAND");
  }
  expect_valid();
}

TEST_F(Cog, TilesThatHoldNothingTakeNoRoomAndReadAsNothing) {
  for (const bool mask : {false, true}) {
    CogShape shape{tile_format(64, 3, 8, Number::Unsigned), to_one_texel};
    shape.format.photometric = Photometric::Rgb;
    shape.mask = mask;
    const auto full = write_cog(path("full.tif"), shape);
    shape.empty = [](std::size_t level, std::size_t tile) { return (level + tile) % 2 == 0; };  // the first one too
    const auto half = write_cog(path("sparse.tif"), shape);
    expect_gdal_reads(path("sparse.tif"), shape);
    EXPECT_LT(half.file_bytes, full.file_bytes * 6 / 10);
    EXPECT_EQ(half.imagery[0][0], 0u);
    expect_valid();
  }
  CogShape nothing{tile_format(64, 1, 16, Number::Unsigned), {{100, 100}, {50, 50}}};
  nothing.empty = [](std::size_t, std::size_t) { return true; };
  const auto bare = write_cog(path("nothing.tif"), nothing);
  EXPECT_EQ(bare.file_bytes, bare.data_begin);
  expect_gdal_reads(path("nothing.tif"), nothing);
  expect_valid();
}

TEST_F(Cog, AnImageOfOneTexelIsAFileLikeAnyOther) {
  for (const bool mask : {false, true}) {
    CogShape shape{tile_format(16, 1, 32, Number::Float), {{1, 1}}};
    shape.mask = mask;
    const std::string file = path(mask ? "masked.tif" : "plain.tif");
    write_cog(file, shape);
    expect_gdal_reads(file, shape);
  }
  expect_valid();
}

TEST_F(Cog, OurOwnReaderFindsTheLevelsTheirTilesAndTheirLosses) {
  CogShape shape{tile_format(64, 3, 16, Number::Unsigned), to_one_texel};
  shape.mask = shape.losses = true;
  shape.empty = [](std::size_t level, std::size_t tile) { return level == 0 && tile == 3; };
  const auto arrangement = write_cog(path("map.tif"), shape);
  const auto source = *LocalFile::open(path("map.tif"));
  const auto file = TiffFile::open(source);
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_TRUE((*file)->cloud_optimized());
  std::size_t image_level = 0, mask_level = 0;
  for (std::uint32_t d = 0; d < (*file)->directories().size(); ++d) {
    const Directory& directory = (*file)->directories()[d];
    const std::size_t level = directory.mask ? mask_level++ : image_level++;
    ASSERT_LT(level, shape.levels.size());
    EXPECT_EQ(directory.width, shape.levels[level].width);
    EXPECT_EQ(directory.height, shape.levels[level].height);
    EXPECT_EQ(directory.reduced, level > 0);
    EXPECT_EQ(directory.format.bits, directory.mask ? 1u : 16u);
    const auto& offsets = (directory.mask ? arrangement.mask : arrangement.imagery)[level];
    for (std::uint32_t row = 0, tile = 0; row < directory.tiles_down(); ++row)
      for (std::uint32_t col = 0; col < directory.tiles_across(); ++col, ++tile) {
        const TileAddress address{d, 0, col, row};
        const auto place = (*file)->locate({&address, 1}).front();
        ASSERT_TRUE(place) << place.error().message;
        EXPECT_EQ(place->offset, offsets[tile]);
        EXPECT_EQ(place->size, offsets[tile] == 0 ? 0 : directory.format.tile_bytes());
      }

    const Field* field = directory.field(tag::tile_losses);
    const bool has_losses = !directory.mask && level + 1 < shape.levels.size();
    ASSERT_EQ(field != nullptr, has_losses);
    if (!has_losses) continue;
    const auto where = (*file)->numbers(*field);
    ASSERT_TRUE(where) << where.error().message;
    ASSERT_EQ(where->size(), 2u);
    ASSERT_EQ(where->at(1), static_cast<double>(directory.tiles_a_plane() * 3));
    std::vector<float> losses(static_cast<std::size_t>(where->at(1)));
    ASSERT_TRUE(source->read(static_cast<std::uint64_t>(where->at(0)), std::as_writable_bytes(std::span(losses))));
    for (std::size_t i = 0; i < losses.size(); ++i)
      EXPECT_EQ(losses[i], expected_loss(level, i / 3, static_cast<std::uint32_t>(i % 3)));
  }
  EXPECT_EQ(image_level, shape.levels.size());
  EXPECT_EQ(mask_level, shape.levels.size());
}

/// What GDAL notes before the first directory: from "GDAL_STRUCTURAL" to where the first directory lies.
std::string notes_of(const std::string& path) {
  const std::string bytes = nadir::test::bytes_of(path);
  std::uint32_t first_directory = 0;
  std::memcpy(&first_directory, bytes.data() + 4, sizeof first_directory);
  return bytes.substr(0, first_directory);
}

/// Kind and size of each directory, in the order of the file.
std::vector<std::array<std::uint32_t, 4>> kinds_of(const std::string& path) {
  std::vector<std::array<std::uint32_t, 4>> kinds;
  const auto file = TiffFile::open(*LocalFile::open(path));
  EXPECT_TRUE(file);
  for (const Directory& d : (*file)->directories()) kinds.push_back({d.reduced, d.mask, d.width, d.height});
  return kinds;
}

TEST_F(Cog, NotesAndDirectoriesAreThoseOfGdalsCogDriver) {
  for (const bool mask : {false, true}) {
    CogShape shape{tile_format(128, 1, 8, Number::Unsigned), {{500, 300}, {250, 150}, {125, 75}}};
    shape.mask = mask;
    write_cog(path("ours.tif"), shape);

    const Dataset memory{GetGDALDriverManager()->GetDriverByName("MEM")->Create("", 500, 300, 1, GDT_Byte, nullptr)};
    if (mask) memory->CreateMaskBand(GMF_PER_DATASET);
    CPLStringList options;
    options.SetNameValue("BLOCKSIZE", "128");
    options.SetNameValue("COMPRESS", "NONE");
    ASSERT_TRUE(Dataset{GetGDALDriverManager()->GetDriverByName("COG")->CreateCopy(
        path("gdal.tif").c_str(), memory.get(), FALSE, options.List(), nullptr, nullptr)});
    EXPECT_EQ(notes_of(path("ours.tif")), notes_of(path("gdal.tif")));
    EXPECT_EQ(kinds_of(path("ours.tif")), kinds_of(path("gdal.tif")));
  }
}

NewField metadata_field(std::size_t bytes) {
  std::string text = "<GDALMetadata>\n  <Item name=\"NOTE\">" + std::string(bytes, 'x') + "</Item>\n</GDALMetadata>\n";
  NewField field{tag::gdal_metadata, 2, text.size() + 1, {}};
  const auto characters = std::as_bytes(std::span(text.c_str(), text.size() + 1));
  field.values.assign(characters.begin(), characters.end());
  return field;
}

TEST_F(Cog, WhatBecomesKnownWhenTilesLieThereFitsIntoTheRoomLeftForIt) {
  CogShape shape{tile_format(64, 1, 8, Number::Unsigned), to_one_texel};
  const auto tight = write_cog(path("before.tif"), shape);
  shape.spare_bytes = 1000;
  const auto roomy = write_cog(path("roomy.tif"), shape);
  EXPECT_GE(roomy.data_begin + 15, tight.data_begin + 1000);  // both are rounded up to 16
  shape.late_fields = {metadata_field(900)};
  const auto late = write_cog(path("late.tif"), shape);
  shape.late_fields = {metadata_field(1100)};
  EXPECT_THROW(write_cog(path("beyond.tif"), shape), std::runtime_error);
  EXPECT_EQ(late.imagery, roomy.imagery);
  EXPECT_EQ(std::string(open(path("late.tif"))->GetMetadataItem("NOTE")), std::string(900, 'x'));
  expect_gdal_reads(path("late.tif"), shape);
  expect_valid();
}

TEST_F(Cog, TilesOfEqualSizesLieWhereTheyAreExpectedBeforeAnyIsWritten) {
  CogShape shape{tile_format(64, 2, 16, Number::Unsigned), to_one_texel, {0}};
  const auto arrangement = write_cog(path("map.tif"), shape);
  std::uint64_t next = arrangement.data_begin;
  for (std::size_t level = shape.levels.size(); level-- > 0;)
    for (const std::uint64_t offset : arrangement.imagery[level]) {
      EXPECT_EQ(offset, next + tile_leader_bytes);
      next = offset + shape.format.tile_bytes() + tile_trailer_bytes;
    }
  EXPECT_EQ(arrangement.file_bytes, next);
}

TEST_F(Cog, AFileIsBigWhereFourGibibytesAreNotEnoughAndOnlyThere) {
  // 23 x 23 tiles of 8 MiB and one level of 1 tile: 4.1 GiB, of which only some are written; the rest are holes.
  CogShape shape{tile_format(1024, 1, 64, Number::Float), {{23 * 1024, 23 * 1024}, {900, 900}}};
  CogImage image = image_of(shape);
  image.fields = {metadata_field(10)};
  const auto bytes = static_cast<std::uint32_t>(shape.format.tile_bytes());
  std::vector<TileSizes> sizes = {{std::vector(23 * 23, bytes), {}}, {{bytes}, {}}};
  const std::vector<TileLosses> losses = {std::vector<float>(23 * 23, 0.5f), {}};
  const auto arrangement = arrange(image, sizes, losses, 0);
  ASSERT_TRUE(arrangement.big);
  ASSERT_GT(arrangement.imagery[0].back(), std::uint64_t{1} << 32);
  {
    const auto head = header(image, sizes, losses, arrangement).value();
    std::ofstream file(path("big.tif"), std::ios::binary);
    file.write(reinterpret_cast<const char*>(head.data()), static_cast<std::streamsize>(head.size()));
    const std::vector<double> last(1024 * 1024, 42.5);
    file.seekp(static_cast<std::streamoff>(arrangement.imagery[0].back()));
    file.write(reinterpret_cast<const char*>(last.data()), bytes);
    const std::vector<double> coarse(1024 * 1024, -7);
    file.seekp(static_cast<std::streamoff>(arrangement.imagery[1].front()));
    file.write(reinterpret_cast<const char*>(coarse.data()), bytes);
    file.seekp(static_cast<std::streamoff>(arrangement.losses[0]));
    file.write(reinterpret_cast<const char*>(losses[0].data()), 23 * 23 * sizeof(float));
    ASSERT_TRUE(file) << "needs a file system with holes";
  }

  const Silence silence;
  const Dataset gdal = open(path("big.tif"));
  ASSERT_TRUE(gdal);
  EXPECT_EQ(std::string(gdal->GetMetadataItem("NOTE")), "xxxxxxxxxx");
  double sample = 0;
  GDALRasterBand* band = gdal->GetRasterBand(1);
  ASSERT_EQ(band->RasterIO(GF_Read, 23 * 1024 - 1, 23 * 1024 - 1, 1, 1, &sample, 1, 1, GDT_Float64, 0, 0, nullptr),
            CE_None);
  EXPECT_EQ(sample, 42.5);
  ASSERT_EQ(band->GetOverview(0)->RasterIO(GF_Read, 3, 3, 1, 1, &sample, 1, 1, GDT_Float64, 0, 0, nullptr), CE_None);
  EXPECT_EQ(sample, -7);

  const auto ours = TiffFile::open(*LocalFile::open(path("big.tif")));
  ASSERT_TRUE(ours) << ours.error().message;
  EXPECT_TRUE((*ours)->cloud_optimized());
  const TileAddress last{0, 0, 22, 22};
  const auto place = (*ours)->locate({&last, 1}).front();
  ASSERT_TRUE(place) << place.error().message;
  EXPECT_EQ(place->offset, arrangement.imagery[0].back());
  const auto where = (*ours)->numbers(*(*ours)->directories()[0].field(tag::tile_losses));
  ASSERT_TRUE(where);
  EXPECT_EQ(*where, (std::vector{static_cast<double>(arrangement.losses[0]), 23.0 * 23}));

  // One tile of imagery fewer than 512 lies below 4 GiB with all its header, leaders and losses: 511 * 8 MiB.
  std::fill(sizes[0].imagery.begin() + 510, sizes[0].imagery.end(), 0);
  const auto small = arrange(image, sizes, losses, 0);
  EXPECT_FALSE(small.big);
  EXPECT_GT(small.file_bytes, std::uint64_t{511} * bytes);
  sizes[0].imagery[510] = bytes;
  EXPECT_TRUE(arrange(image, sizes, losses, 0).big);
}

}  // namespace
}  // namespace nadir::tiff

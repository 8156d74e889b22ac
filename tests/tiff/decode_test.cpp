#include "nadir/tiff/decode.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "nadir/tiff/tiff_file.h"
#include "support/temporary_folder.h"

// Every way of packing tiles that is read here, written by GDAL and compared with what GDAL reads.
namespace nadir::tiff {
namespace {

using test::TemporaryFolder;

constexpr int width = 150, height = 91;  // no multiple of a tile

/// All samples of a directory as doubles: rows of texels, bands interleaved.
std::vector<double> read_directory(const TiffFile& file, std::uint32_t index) {
  const Directory& d = file.directories()[index];
  const TileFormat& f = d.format;
  std::vector<double> samples(std::size_t{d.width} * d.height * f.samples, -12345);
  for (std::uint32_t plane = 0; plane < (f.separate ? f.samples : 1); ++plane)
    for (std::uint32_t row = 0; row < d.tiles_down(); ++row)
      for (std::uint32_t col = 0; col < d.tiles_across(); ++col) {
        const TileAddress tile{index, plane, col, row};
        const TilePlace place = file.locate({&tile, 1}).front().value();
        std::vector<std::byte> packed(place.size);
        EXPECT_TRUE(file.source().read(place.offset, packed));
        const auto done = decode_tile(f, packed, f.tile_height, [&](std::uint32_t y, const std::byte* data) {
          with_sample(decoded_sample(f), [&]<class T>(T) {
            const std::uint32_t at_y = row * f.tile_height + y;
            for (std::uint32_t x = 0; x < f.tile_width; ++x)
              for (std::uint32_t s = 0; s < f.samples_together(); ++s) {
                const std::uint32_t at_x = col * f.tile_width + x;
                if (at_x >= d.width || at_y >= d.height) continue;
                samples[(std::size_t{at_y} * d.width + at_x) * f.samples + plane + s] =
                    static_cast<double>(reinterpret_cast<const T*>(data)[x * f.samples_together() + s]);
              }
          });
        });
        EXPECT_TRUE(done) << done.error().message;
      }
  return samples;
}

std::vector<double> read_by_gdal(const std::string& path) {
  const std::unique_ptr<GDALDataset> dataset(GDALDataset::Open(path.c_str()));
  const int bands = dataset->GetRasterCount();
  std::vector<double> samples(static_cast<std::size_t>(dataset->GetRasterXSize()) * dataset->GetRasterYSize() * bands);
  EXPECT_EQ(dataset->RasterIO(GF_Read, 0, 0, dataset->GetRasterXSize(), dataset->GetRasterYSize(), samples.data(),
                              dataset->GetRasterXSize(), dataset->GetRasterYSize(), GDT_Float64, bands, nullptr,
                              bands * 8, static_cast<GSpacing>(bands) * 8 * dataset->GetRasterXSize(), 8, nullptr),
            CE_None);
  return samples;
}

struct Packing {
  const char* name;
  GDALDataType type;
  int bands;
  std::vector<const char*> options;
};
std::ostream& operator<<(std::ostream& out, const Packing& p) { return out << p.name; }

/// Smooth with noise, so that every codec has something to do; of full range.
double content(GDALDataType type, int bits, int band, int x, int y) {
  std::mt19937 noise(static_cast<unsigned>((y * width + x) * 16 + band));
  const double unit = 0.5 + 0.4 * std::sin(0.07 * x + band) * std::cos(0.05 * y) + 0.1 * (noise() % 1000) / 1000.0;
  if (type == GDT_Float32 || type == GDT_Float64) return noise() % 50 == 0 ? -1e30 : (unit - 0.3) * 1e4;
  const bool is_signed = type == GDT_Int16 || type == GDT_Int32;
  const double range = std::ldexp(1.0, bits);
  return std::floor(unit * (range - 1) - (is_signed ? range / 2 : 0));
}

void write(const Packing& packing, const std::string& path) {
  GDALAllRegister();
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  std::vector<const char*> options = {"TILED=YES", "BLOCKXSIZE=64", "BLOCKYSIZE=32"};
  int bits = GDALGetDataTypeSizeBits(packing.type);
  for (const char* option : packing.options) {
    options.push_back(option);
    if (std::string(option).starts_with("NBITS=")) bits = std::atoi(option + 6);
  }
  options.push_back(nullptr);
  const std::unique_ptr<GDALDataset> dataset(
      driver->Create(path.c_str(), width, height, packing.bands, packing.type, const_cast<char**>(options.data())));
  ASSERT_TRUE(dataset);
  std::vector<double> row(width);
  for (int b = 0; b < packing.bands; ++b)
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) row[static_cast<std::size_t>(x)] = content(packing.type, bits, b, x, y);
      ASSERT_EQ(dataset->GetRasterBand(b + 1)->RasterIO(GF_Write, 0, y, width, 1, row.data(), width, 1, GDT_Float64, 0,
                                                        0, nullptr),
                CE_None);
    }
}

class EveryPacking : public testing::TestWithParam<Packing> {};

TEST_P(EveryPacking, GivesTheSamplesThatGdalReads) {
  const TemporaryFolder folder;
  const std::string path = folder.file("m.tif");
  write(GetParam(), path);
  const auto file = TiffFile::open(LocalFile::open(path).value());
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_EQ((*file)->directories().size(), 1u);
  const auto ours = read_directory(**file, 0), theirs = read_by_gdal(path);
  ASSERT_EQ(ours.size(), theirs.size());
  std::size_t different = 0;
  for (std::size_t i = 0; i < ours.size(); ++i)
    different += !(ours[i] == theirs[i] || (std::isnan(ours[i]) && std::isnan(theirs[i])));
  EXPECT_EQ(different, 0u) << "of " << ours.size();
}

INSTANTIATE_TEST_SUITE_P(
    Tiff, EveryPacking,
    testing::Values(
        Packing{"none_u8_1", GDT_Byte, 1, {}}, Packing{"none_u8_3", GDT_Byte, 3, {}},
        Packing{"none_u8_3_separate", GDT_Byte, 3, {"INTERLEAVE=BAND"}}, Packing{"none_u16_4", GDT_UInt16, 4, {}},
        Packing{"none_i16_2_big", GDT_Int16, 2, {"ENDIANNESS=BIG"}},
        Packing{"none_f32_1_bigtiff", GDT_Float32, 1, {"BIGTIFF=YES"}},
        Packing{"none_f64_2_big_bigtiff", GDT_Float64, 2, {"BIGTIFF=YES", "ENDIANNESS=BIG"}},
        Packing{"none_u32_1", GDT_UInt32, 1, {}}, Packing{"none_i32_1_big", GDT_Int32, 1, {"ENDIANNESS=BIG"}},
        Packing{"bits_1", GDT_Byte, 1, {"NBITS=1"}}, Packing{"bits_2", GDT_Byte, 3, {"NBITS=2"}},
        Packing{"bits_4_deflate", GDT_Byte, 3, {"NBITS=4", "COMPRESS=DEFLATE"}},
        Packing{"bits_7", GDT_Byte, 1, {"NBITS=7"}}, Packing{"bits_10", GDT_UInt16, 1, {"NBITS=10"}},
        Packing{"bits_12_3_big", GDT_UInt16, 3, {"NBITS=12", "ENDIANNESS=BIG"}},
        Packing{"bits_15_zstd", GDT_UInt16, 2, {"NBITS=15", "COMPRESS=ZSTD"}},
        Packing{"bits_17", GDT_UInt32, 1, {"NBITS=17"}}, Packing{"bits_24", GDT_UInt32, 2, {"NBITS=24"}},
        Packing{"bits_24_big", GDT_UInt32, 1, {"NBITS=24", "ENDIANNESS=BIG"}},
        Packing{"bits_31", GDT_UInt32, 1, {"NBITS=31"}}, Packing{"float_16", GDT_Float32, 1, {"NBITS=16"}},
        Packing{"float_16_big", GDT_Float32, 2, {"NBITS=16", "ENDIANNESS=BIG"}},
        Packing{"float_16_predictor_3", GDT_Float32, 1, {"NBITS=16", "COMPRESS=DEFLATE", "PREDICTOR=3"}},
        Packing{"deflate_u8_3", GDT_Byte, 3, {"COMPRESS=DEFLATE"}},
        Packing{"deflate_u8_3_p2", GDT_Byte, 3, {"COMPRESS=DEFLATE", "PREDICTOR=2"}},
        Packing{"deflate_u8_1_p2", GDT_Byte, 1, {"COMPRESS=DEFLATE", "PREDICTOR=2"}},
        Packing{"deflate_u8_2_p2", GDT_Byte, 2, {"COMPRESS=DEFLATE", "PREDICTOR=2"}},
        Packing{"deflate_u8_4_p2", GDT_Byte, 4, {"COMPRESS=DEFLATE", "PREDICTOR=2"}},
        Packing{"deflate_u8_5_p2", GDT_Byte, 5, {"COMPRESS=DEFLATE", "PREDICTOR=2"}},
        Packing{"deflate_u16_3_p2_big", GDT_UInt16, 3, {"COMPRESS=DEFLATE", "PREDICTOR=2", "ENDIANNESS=BIG"}},
        Packing{"deflate_i32_1_p2", GDT_Int32, 1, {"COMPRESS=DEFLATE", "PREDICTOR=2"}},
        Packing{"deflate_f64_1_p2", GDT_Float64, 1, {"COMPRESS=DEFLATE", "PREDICTOR=2"}},
        Packing{"deflate_f32_2_p3_big", GDT_Float32, 2, {"COMPRESS=DEFLATE", "PREDICTOR=3", "ENDIANNESS=BIG"}},
        Packing{"zstd_u8_3_p2_separate", GDT_Byte, 3, {"COMPRESS=ZSTD", "PREDICTOR=2", "INTERLEAVE=BAND"}},
        Packing{"zstd_f32_1_p3", GDT_Float32, 1, {"COMPRESS=ZSTD", "PREDICTOR=3"}},
        Packing{"zstd_f64_3_p3", GDT_Float64, 3, {"COMPRESS=ZSTD", "PREDICTOR=3"}},
        Packing{"lzw_u8_3", GDT_Byte, 3, {"COMPRESS=LZW"}},
        Packing{"lzw_u8_1_p2", GDT_Byte, 1, {"COMPRESS=LZW", "PREDICTOR=2"}},
        Packing{"lzw_u16_4", GDT_UInt16, 4, {"COMPRESS=LZW"}}, Packing{"lzw_f32_1", GDT_Float32, 1, {"COMPRESS=LZW"}},
        Packing{"lzma_u16_3_p2", GDT_UInt16, 3, {"COMPRESS=LZMA", "PREDICTOR=2"}},
        Packing{"jpeg_1", GDT_Byte, 1, {"COMPRESS=JPEG"}}, Packing{"jpeg_3_rgb", GDT_Byte, 3, {"COMPRESS=JPEG"}},
        Packing{"jpeg_3_ycbcr", GDT_Byte, 3, {"COMPRESS=JPEG", "PHOTOMETRIC=YCBCR"}},
        Packing{"jpeg_3_ycbcr_own_tables", GDT_Byte, 3, {"COMPRESS=JPEG", "PHOTOMETRIC=YCBCR", "JPEGTABLESMODE=0"}},
        Packing{"jpeg_3_separate", GDT_Byte, 3, {"COMPRESS=JPEG", "INTERLEAVE=BAND"}},
        Packing{"jpeg_4", GDT_Byte, 4, {"COMPRESS=JPEG", "PHOTOMETRIC=RGB"}},
        Packing{"webp_3", GDT_Byte, 3, {"COMPRESS=WEBP"}},
        Packing{"webp_4_exact", GDT_Byte, 4, {"COMPRESS=WEBP", "WEBP_LOSSLESS=TRUE"}},
        Packing{"lerc_u8_3", GDT_Byte, 3, {"COMPRESS=LERC", "PHOTOMETRIC=RGB"}},
        Packing{"lerc_u16_1_zstd", GDT_UInt16, 1, {"COMPRESS=LERC_ZSTD"}},
        Packing{"lerc_f32_1_deflate", GDT_Float32, 1, {"COMPRESS=LERC_DEFLATE"}},
        Packing{"lerc_f64_2_lossy", GDT_Float64, 2, {"COMPRESS=LERC", "MAX_Z_ERROR=0.5"}}),
    [](const auto& packing) { return std::string(packing.param.name); });

class CutShort : public testing::TestWithParam<Packing> {};

TEST_P(CutShort, AFileOfAnyLengthIsAnErrorOrRight) {
  const TemporaryFolder folder;
  write(GetParam(), folder.file("whole.tif"));
  const std::string whole = test::bytes_of(folder.file("whole.tif"));
  const auto right = read_directory(*TiffFile::open(LocalFile::open(folder.file("whole.tif")).value()).value(), 0);
  // Every length of what is small, a thousand of the rest
  const std::size_t step = std::max<std::size_t>(1, whole.size() / 1000);
  std::size_t opened = 0, refused = 0;
  std::vector<std::size_t> wrong;
  for (std::size_t length = 0; length < whole.size(); length += length < 600 ? 1 : step) {
    std::ofstream(folder.file("cut.tif"), std::ios::binary) << whole.substr(0, length);
    const auto file = TiffFile::open(LocalFile::open(folder.file("cut.tif")).value());
    if (!file) {
      ++refused;
      continue;
    }
    ++opened;
    // Each tile is right or an error
    const Directory& d = (*file)->directories().front();
    const TileFormat& f = d.format;
    for (std::uint32_t row = 0; row < d.tiles_down(); ++row)
      for (std::uint32_t col = 0; col < d.tiles_across(); ++col) {
        const TileAddress tile{0, 0, col, row};
        const auto place = (*file)->locate({&tile, 1}).front();
        if (!place) continue;
        std::vector<std::byte> packed(place->size);
        if (!(*file)->source().read(place->offset, packed)) continue;
        bool same = true;
        const auto done = decode_tile(f, packed, f.tile_height, [&](std::uint32_t y, const std::byte* data) {
          with_sample(decoded_sample(f), [&]<class T>(T) {
            for (std::uint32_t x = 0; x < f.tile_width * f.samples; ++x) {
              const std::uint32_t at_x = col * f.tile_width + x / f.samples, at_y = row * f.tile_height + y;
              if (at_x >= d.width || at_y >= d.height) continue;
              const double expected = right[(std::size_t{at_y} * d.width + at_x) * f.samples + x % f.samples];
              same = same && static_cast<double>(reinterpret_cast<const T*>(data)[x]) == expected;
            }
          });
        });
        if (done && !same) wrong.push_back(length);
      }
  }
  EXPECT_EQ(wrong, std::vector<std::size_t>{}) << "lengths that gave another picture";
  EXPECT_GT(refused, 0u);
  EXPECT_GT(opened, 100u) << "headers come first: most of these files can be opened";
}

// Headers first, so that tiles are what is cut
INSTANTIATE_TEST_SUITE_P(Tiff, CutShort,
                         testing::Values(Packing{"none", GDT_UInt16, 2, {}},
                                         Packing{"lzw", GDT_Byte, 3, {"COMPRESS=LZW"}},
                                         Packing{"deflate", GDT_Byte, 3, {"COMPRESS=DEFLATE", "PREDICTOR=2"}},
                                         Packing{"zstd", GDT_Float32, 1, {"COMPRESS=ZSTD", "PREDICTOR=3"}},
                                         Packing{"lzma", GDT_Byte, 1, {"COMPRESS=LZMA"}},
                                         Packing{"jpeg", GDT_Byte, 3, {"COMPRESS=JPEG", "PHOTOMETRIC=YCBCR"}},
                                         Packing{"webp", GDT_Byte, 3, {"COMPRESS=WEBP"}},
                                         Packing{"lerc", GDT_Byte, 1, {"COMPRESS=LERC"}}),
                         [](const auto& packing) { return std::string(packing.param.name); });

}  // namespace
}  // namespace nadir::tiff

#include "nadir/tiff/encode.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

#include "nadir/tiff/decode.h"

namespace nadir::tiff {
namespace {

TileFormat format_of(Codec codec, std::uint32_t bits, Number number, std::uint32_t samples, Predictor predictor) {
  TileFormat format;
  format.tile_width = 128;
  format.tile_height = 48;
  format.samples = samples;
  format.bits = bits;
  format.number = number;
  format.codec = codec;
  format.predictor = predictor;
  return format;
}

/// Noise below, a constant above; `stride` bytes a row.
std::vector<std::byte> half_noise(const TileFormat& format, std::size_t stride) {
  std::mt19937 random(1);
  std::vector<std::byte> rows(stride * format.tile_height);
  for (std::size_t i = rows.size() / 2; i < rows.size(); ++i) rows[i] = static_cast<std::byte>(random() & 0xff);
  return rows;
}

void expect_round_trip(const TileFormat& asked, const Packing& packing = {}) {
  const auto encoder = TileEncoder::create(asked, packing);
  ASSERT_TRUE(encoder) << encoder.error().message;
  const auto row_bytes = static_cast<std::size_t>(asked.row_bytes()), stride = row_bytes + 64;
  const auto rows = half_noise(asked, stride);
  RawBytes packed(3);  // it appends
  const auto size = encoder->append(rows.data(), stride, packed);
  ASSERT_TRUE(size) << size.error().message;
  ASSERT_EQ(packed.size(), *size + 3);
  std::uint32_t seen = 0;
  const auto done = decode_tile(encoder->format(), std::span(packed).subspan(3), asked.tile_height,
                                [&](std::uint32_t y, const std::byte* row) {
                                  ++seen;
                                  EXPECT_EQ(std::memcmp(row, rows.data() + y * stride, row_bytes), 0) << "row " << y;
                                });
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(seen, asked.tile_height);
}

TEST(TileEncoder, StreamsGiveBackEverySampleTypeWithEveryPredictor) {
  for (const Codec codec : {Codec::None, Codec::Lzw, Codec::Deflate, Codec::Zstd, Codec::Lzma})
    for (const Number number : {Number::Unsigned, Number::Signed, Number::Float})
      for (const std::uint32_t bits : {8u, 16u, 32u, 64u})
        for (const std::uint32_t samples : {1u, 2u, 3u, 4u, 5u})
          for (const Predictor predictor : {Predictor::None, Predictor::Horizontal, Predictor::FloatingPoint}) {
            if (number == Number::Float && bits < 32) continue;
            if (codec == Codec::None && predictor != Predictor::None) continue;
            if (predictor == Predictor::FloatingPoint && number != Number::Float) continue;
            SCOPED_TRACE(std::string(to_string(codec)) + ", bits " + std::to_string(bits) + ", samples " +
                         std::to_string(samples) + ", predictor " + std::to_string(static_cast<int>(predictor)));
            expect_round_trip(format_of(codec, bits, number, samples, predictor));
          }
}

TEST(TileEncoder, BandsOfTheirOwnHaveTilesOfOneSample) {
  for (const Codec codec : {Codec::None, Codec::Lzw, Codec::Deflate, Codec::Zstd, Codec::Lzma})
    for (const Predictor predictor : {Predictor::None, Predictor::FloatingPoint}) {
      if (codec == Codec::None && predictor != Predictor::None) continue;
      auto format = format_of(codec, 64, Number::Float, 6, predictor);
      format.separate = true;
      ASSERT_EQ(format.row_bytes(), 128u * 8);
      expect_round_trip(format);
    }
}

TEST(TileEncoder, WebPAt100AndLercWithoutErrorLoseNothing) {
  for (const std::uint32_t samples : {3u, 4u})
    expect_round_trip(format_of(Codec::WebP, 8, Number::Unsigned, samples, Predictor::None), {.quality = 100});
  for (int packing = 0; packing < 3; ++packing) {
    auto format = format_of(Codec::Lerc, 16, Number::Unsigned, 1, Predictor::None);
    format.lerc_packing = packing;
    expect_round_trip(format);
  }
}

TEST(TileEncoder, RefusesWhatIsOutOfRange) {
  const auto bytes = [](Codec codec, std::uint32_t samples) {
    return format_of(codec, 8, Number::Unsigned, samples, Predictor::None);
  };
  EXPECT_FALSE(TileEncoder::create(bytes(Codec::Deflate, 1), {.level = 13}));
  EXPECT_FALSE(TileEncoder::create(bytes(Codec::Zstd, 1), {.level = 23}));
  EXPECT_FALSE(TileEncoder::create(bytes(Codec::Jpeg, 3), {.quality = 0}));
  EXPECT_FALSE(TileEncoder::create(bytes(Codec::Jpeg, 4), {}));
  EXPECT_FALSE(TileEncoder::create(bytes(Codec::WebP, 1), {}));
  EXPECT_FALSE(TileEncoder::create(bytes(Codec::Lerc, 1), {.max_error = std::numeric_limits<double>::infinity()}));
  EXPECT_FALSE(TileEncoder::create(format_of(Codec::Jpeg, 8, Number::Unsigned, 1, Predictor::Horizontal), {}));
  auto separate = bytes(Codec::Jpeg, 3);
  separate.separate = true;
  EXPECT_FALSE(TileEncoder::create(separate, {}));
}

}  // namespace
}  // namespace nadir::tiff

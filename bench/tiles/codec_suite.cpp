#include "codec_suite.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>

#include "nadir/bench/procedural_tiff.h"
#include "nadir/tiff/decode.h"
#include "nadir/tiff/encode.h"
#include "nadir/tile/map.h"

namespace nadir::bench {
namespace {

using tiff::Codec, tiff::Predictor, tiff::TileFormat;

/// All samples of a raster, bands interleaved.
struct Raster {
  std::vector<std::byte> samples;
  std::uint32_t width = 0, height = 0, bands = 0;
  tile::SampleType type = tile::SampleType::UInt8;
  bool labels = false;  // neighbours' differences tell nothing
};

Result<Raster> read_raster(const std::string& path, const std::vector<int>& bands) {
  const auto map = tile::Map::open(path);
  if (!map) return fail(map);
  auto texels = map->read(0, {0, 0, map->width(), map->height()}, bands);
  if (!texels) return fail(texels);
  return Raster{std::move(texels->samples),
                static_cast<std::uint32_t>(map->width()),
                static_cast<std::uint32_t>(map->height()),
                static_cast<std::uint32_t>(bands.size()),
                texels->type,
                false};
}

struct Packing {
  std::string name;
  Codec codec;
  tiff::Packing packing;
  std::uint32_t side = 512;
};

TileFormat format_of(const Raster& raster, const Packing& how) {
  TileFormat format;
  format.tile_width = format.tile_height = how.side;
  format.samples = raster.bands;
  format.bits = 8 * static_cast<std::uint32_t>(tile::size_bytes(raster.type));
  const bool floating = raster.type == tile::SampleType::Float32;
  format.number = floating                                 ? tiff::Number::Float
                  : raster.type == tile::SampleType::Int16 ? tiff::Number::Signed
                                                           : tiff::Number::Unsigned;
  format.codec = how.codec;
  const bool stream =
      how.codec != Codec::None && how.codec != Codec::Jpeg && how.codec != Codec::WebP && how.codec != Codec::Lerc;
  if (stream && !raster.labels) format.predictor = floating ? Predictor::FloatingPoint : Predictor::Horizontal;
  if (raster.bands == 3) format.photometric = tiff::Photometric::Rgb;
  return format;
}

/// A raster's whole tiles, packed.
struct Packed {
  TileFormat format;
  std::vector<RawBytes> tiles;
  std::vector<const std::byte*> corners;  // of the raster's samples
  std::size_t stride = 0;                 // of its rows
  double encode_ms = 0;
  std::uint64_t bytes() const {
    std::uint64_t sum = 0;
    for (const RawBytes& tile : tiles) sum += tile.size();
    return sum;
  }
};

Result<std::shared_ptr<const Packed>> pack(const std::shared_ptr<const Raster>& raster, const Packing& how) {
  auto packed = std::make_shared<Packed>();
  const auto encoder = tiff::TileEncoder::create(format_of(*raster, how), how.packing);
  if (!encoder) return fail(encoder);
  packed->format = encoder->format();
  const std::size_t texel = raster->bands * tile::size_bytes(raster->type);
  packed->stride = raster->width * texel;
  const auto begin = std::chrono::steady_clock::now();
  for (std::uint32_t y = 0; y + how.side <= raster->height; y += how.side)
    for (std::uint32_t x = 0; x + how.side <= raster->width; x += how.side) {
      packed->corners.push_back(raster->samples.data() + y * packed->stride + x * texel);
      packed->tiles.emplace_back();
      if (const auto size = encoder->append(packed->corners.back(), packed->stride, packed->tiles.back()); !size)
        return fail(size);
    }
  packed->encode_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return packed;
}

Result<void> decode(const Packed& packed,
                    const std::function<void(std::size_t, std::uint32_t, const std::byte*)>& row) {
  for (std::size_t i = 0; i < packed.tiles.size(); ++i)
    if (const auto ok = tiff::decode_tile(packed.format, packed.tiles[i], packed.format.tile_height,
                                          [&](std::uint32_t y, const std::byte* samples) { row(i, y, samples); });
        !ok)
      return fail(ok);
  return {};
}

/// RMS of what decoding differs by from what was packed, in stored units.
Result<double> error_of(const Raster& raster, const Packed& packed) {
  double squares = 0, count = 0;
  const auto done = decode(packed, [&](std::size_t tile, std::uint32_t y, const std::byte* row) {
    tile::with_sample_type(raster.type, [&]<class T>(T) {
      const auto* a = reinterpret_cast<const T*>(row);
      const auto* b = reinterpret_cast<const T*>(packed.corners[tile] + y * packed.stride);
      for (std::size_t i = 0; i < std::size_t{packed.format.tile_width} * packed.format.samples; ++i) {
        const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        if (std::isfinite(d)) squares += d * d;
        ++count;
      }
    });
  });
  if (!done) return fail(done);
  return std::sqrt(squares / count);
}

Method method_of(const std::shared_ptr<const Raster>& raster, const Packing& how) {
  Method method{.name = how.name, .setting = how.side == 512 ? "" : fmt::format("tiles of {}", how.side)};
  const auto packed = pack(raster, how);
  if (!packed) {
    method.left_out = packed.error().message;
    return method;
  }
  const std::shared_ptr<const Packed> tiles = *packed;
  method.run = [tiles]() -> Result<void> {
    return decode(*tiles, [](std::size_t, std::uint32_t, const std::byte*) {});
  };
  method.error = [raster, tiles] { return error_of(*raster, *tiles); };
  method.counters = [tiles]() -> std::map<std::string, std::string> {
    const double unpacked = static_cast<double>(tiles->format.tile_bytes()) * static_cast<double>(tiles->tiles.size());
    return {{"written_bytes", std::to_string(tiles->bytes())},
            {"packing", fmt::format("{:.4g}", unpacked / static_cast<double>(tiles->bytes()))},
            {"encode_ms", fmt::format("{:.4g}", tiles->encode_ms)}};
  };
  return method;
}

std::vector<Packing> packings(const Raster& raster) {
  std::vector<Packing> all = {{"none", Codec::None, {}}};
  for (const int level : {1, 6, 12})
    all.push_back({fmt::format("deflate {}", level), Codec::Deflate, {.level = level}});
  for (const int level : {1, 3, 9, 15, 19})
    all.push_back({fmt::format("zstd {}", level), Codec::Zstd, {.level = level}});
  all.push_back({"lzw", Codec::Lzw, {}});
  all.push_back({"lzma 6", Codec::Lzma, {.level = 6}});
  all.push_back({"lerc", Codec::Lerc, {}});
  if (raster.type == tile::SampleType::UInt8 && raster.bands == 3) {
    for (const int quality : {75, 90, 95})
      all.push_back({fmt::format("jpeg {}", quality), Codec::Jpeg, {.quality = quality}});
    for (const int quality : {75, 90, 100})
      all.push_back({fmt::format("webp {}", quality), Codec::WebP, {.quality = quality}});
  }
  for (const std::uint32_t side : {128u, 256u, 1024u})
    if (side <= raster.width && side <= raster.height) all.push_back({"zstd 9", Codec::Zstd, {.level = 9}, side});
  return all;
}

Case codecs_of(const std::string& name, const std::function<Result<Raster>()>& open) {
  return {name, [=]() -> Result<Comparison> {
            auto read = open();
            if (!read) return fail(read);
            const auto raster = std::make_shared<const Raster>(std::move(*read));
            Comparison comparison{
                .error_unit = "RMS", .work = static_cast<double>(raster->samples.size()) / 1e6, .work_unit = "MB"};
            for (const Packing& how : packings(*raster)) comparison.methods.push_back(method_of(raster, how));
            return comparison;
          }};
}

Result<Raster> hills(const RunOptions& options) {
  const std::string path = (std::filesystem::path(options.scratch) / "hills.tif").string();
  MapRule rule;
  rule.width = rule.height = 2048;
  rule.bands = 1;
  rule.type = SampleType::f32;
  if (const auto ok = write_map(path, rule, true); !ok) return fail(ok);
  return read_raster(path, {1});
}

/// Eight classes of brightness.
Result<Raster> labels(const std::string& photo) {
  auto raster = read_raster(photo, {2});
  if (!raster) return raster;
  raster->labels = true;
  for (std::byte& sample : raster->samples)
    sample = std::byte{static_cast<std::uint8_t>(std::to_integer<int>(sample) / 32)};
  return raster;
}

}  // namespace

Suite codec_suite() {
  return {"codecs", "bytes of packed tiles against the time to decode them, on one thread",
          [](const RunOptions& options) {
            const std::string maps = NADIR_SOURCE_DIR "/sim/demo/maps/";
            return std::vector<Case>{
                codecs_of("orthophoto, 3 of uint8",
                          [=] {
                            return read_raster(maps + "kampala.tif", {1, 2, 3});
                          }),
                codecs_of("multispectral, 4 of int16",
                          [=] {
                            return read_raster(maps + "spain_s2.tif", {2, 3, 4, 8});
                          }),
                codecs_of("radar in decibels, float32", [=] { return read_raster(maps + "spain_s1.tif", {1}); }),
                codecs_of("elevation, float32", [=] { return hills(options); }),
                codecs_of("labels, uint8", [=] { return labels(maps + "kampala.tif"); }),
            };
          }};
}

}  // namespace nadir::bench

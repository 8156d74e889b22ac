#include "choices.h"
#include <array>

#include <fmt/format.h>

#include <algorithm>

namespace nadir::pyramid {
namespace {

using mosaic::Sources;

/// "2014", "2014-07", "2014-07-20" or "2014-07-20T17:05:00Z".
bool is_date(std::string_view text) {
  static constexpr std::string_view shape = "0000-00-00T00:00:00Z";
  if (text.size() != 4 && text.size() != 7 && text.size() != 10 && text.size() != 20) return false;
  for (std::size_t i = 0; i < text.size(); ++i)
    if (shape[i] == '0' ? text[i] < '0' || text[i] > '9' : text[i] != shape[i]) return false;
  const auto two_digits = [&](std::size_t at) {
    return text.size() > at ? (text[at] - '0') * 10 + text[at + 1] - '0' : 1;
  };
  return two_digits(5) >= 1 && two_digits(5) <= 12 && two_digits(8) >= 1 && two_digits(8) <= 31;
}

tl::unexpected<Error> refuse(std::string why) { return fail(Error::Kind::Unsupported, std::move(why)); }

bool is_floating(mosaic::Sample sample) { return sample == mosaic::Sample::F32 || sample == mosaic::Sample::F64; }

tiff::Codec codec_of(Compression compression) {
  switch (compression) {
    case Compression::Deflate:
      return tiff::Codec::Deflate;
    case Compression::Zstd:
      return tiff::Codec::Zstd;
    case Compression::Lzw:
      return tiff::Codec::Lzw;
    case Compression::Lzma:
      return tiff::Codec::Lzma;
    case Compression::Jpeg:
      return tiff::Codec::Jpeg;
    case Compression::Webp:
      return tiff::Codec::WebP;
    case Compression::Lerc:
      return tiff::Codec::Lerc;
    case Compression::None:
      break;
  }
  return tiff::Codec::None;
}

bool has_predictor(Compression compression) {
  return compression == Compression::Deflate || compression == Compression::Zstd || compression == Compression::Lzw ||
         compression == Compression::Lzma;
}

/// Differences between neighbours pack better where neighbours are alike, which labels are not.
tiff::Predictor usual_predictor(const BuildOptions& options, bool labels, mosaic::Sample sample) {
  if (!has_predictor(options.compression) || labels) return tiff::Predictor::None;
  return is_floating(sample) ? tiff::Predictor::FloatingPoint : tiff::Predictor::Horizontal;
}

tiff::Photometric photometric_of(const Sources& sources) {
  if (!sources.palette.empty()) return tiff::Photometric::Palette;
  static constexpr std::array colors = {"Red", "Green", "Blue"};
  if (sources.bands.size() < colors.size()) return tiff::Photometric::MinIsBlack;
  const bool rgb =
      std::equal(colors.begin(), colors.end(), sources.bands.begin(),
                 [](const char* color, const mosaic::BandProperties& band) { return band.color == color; });
  return rgb ? tiff::Photometric::Rgb : tiff::Photometric::MinIsBlack;
}

}  // namespace

bool is_lossy(const BuildOptions& options) {
  return options.compression == Compression::Jpeg ||
         (options.compression == Compression::Webp && options.quality != 100) || options.max_error > 0;
}

std::string_view name_of(mosaic::Sample sample) {
  static constexpr std::array<std::string_view, 10> names = {"uint8", "int8",   "uint16", "int16",   "uint32",
                                                             "int32", "uint64", "int64",  "float32", "float64"};
  return names[static_cast<std::size_t>(sample)];
}

Result<void> check_options(const BuildOptions& options) {
  const Compression codec = options.compression;
  if (options.sources.empty()) return fail(Error::Kind::NotFound, "no source: name a raster, or a folder of them");
  if (options.output.filename().empty() || options.output.string().starts_with("/vsi"))
    return refuse(fmt::format("{}: expected the name of a file on disk to write", options.output.string()));
  if (options.tile_size < 128 || options.tile_size > 1024 || options.tile_size % 16 != 0)
    return refuse(fmt::format("tile size {}: expected a multiple of 16 from 128 to 1024", options.tile_size));
  if (!options.acquired.empty() && !is_date(options.acquired))
    return fail(
        Error::Kind::Malformed,
        fmt::format("acquired '{}': expected a date such as 2014-07-20 or 2014-07-20T17:05:00Z", options.acquired));
  if (options.quality && codec != Compression::Jpeg && codec != Compression::Webp)
    return refuse(fmt::format("quality {}: {} has none, it is for jpeg and webp", *options.quality, to_string(codec)));
  if (options.quality && (*options.quality < 1 || *options.quality > 100))
    return fail(Error::Kind::Malformed, fmt::format("quality {}: expected 1 to 100", *options.quality));
  if (!(options.max_error >= 0) || (options.max_error > 0 && codec != Compression::Lerc))
    return refuse(fmt::format("largest error {}: it is for lerc, and at least 0", options.max_error));
  if (options.level && !has_predictor(codec))
    return refuse(
        fmt::format("level {}: {} has none, it is for deflate, zstd and lzma", *options.level, to_string(codec)));
  if (options.predictor && *options.predictor != tiff::Predictor::None && !has_predictor(codec))
    return refuse(fmt::format("predictor: {} has none, it is for deflate, zstd, lzw and lzma", to_string(codec)));
  if (options.radar_scale && options.role && options.role != tile::Role::Radar)
    return refuse(fmt::format("radar scale {}: it is for role radar", to_string(*options.radar_scale)));
  if (options.shard && options.join > 0) return refuse("shard and join: one process makes a shard, another joins them");
  if (options.shard && (options.shard->count < 1 || options.shard->number < 1 ||
                        options.shard->number > options.shard->count || options.shard->count > 10000))
    return refuse(fmt::format("shard {}/{}: expected I/N with I from 1 to N, N at most 10000", options.shard->number,
                              options.shard->count));
  if (options.join < 0 || options.join > 10000)
    return refuse(fmt::format("join {}: expected a number of shards from 1 to 10000", options.join));
  if (!(options.tolerance_texels > 0 && options.tolerance_texels <= 1))
    return refuse(fmt::format("tolerance {}: expected more than 0, at most 1 texel", options.tolerance_texels));
  return {};
}

std::optional<tile::Role> choose_role(const BuildOptions& options, const Sources& sources) {
  if (options.role) return options.role;
  const std::string& stated = sources.rasters.front()->description().role;
  for (const auto& source : sources.rasters)
    if (source->description().role != stated) return std::nullopt;
  const auto role = tile::parse_role(stated);
  return role ? std::optional(*role) : std::nullopt;
}

Result<Reduction> choose_reduction(const BuildOptions& options, std::optional<tile::Role> role, const Sources& sources,
                                   std::vector<std::string>& warnings) {
  if (options.radar_scale && role != tile::Role::Radar)
    return refuse(fmt::format("radar scale {}: it is for role radar", to_string(*options.radar_scale)));
  Reduction reduction;
  const bool palette = !sources.palette.empty(), labels = role == tile::Role::Labels;
  reduction.filter = options.filter.value_or(labels || palette           ? Filter::Mode
                                             : role == tile::Role::Radar ? Filter::Box
                                                                         : Filter::Lanczos);
  const bool blends = reduction.filter != Filter::Mode && reduction.filter != Filter::Nearest;
  if (blends && (labels || palette))
    return refuse(fmt::format("filter {}: labels and palettes are never blended: choose mode or nearest",
                              to_string(reduction.filter)));
  if (palette && !labels)
    warnings.push_back(
        fmt::format("{} holds palette indices, which are never blended: give it role labels, or expand "
                    "it with gdal_translate -expand rgb",
                    sources.rasters.front()->label()));
  if (role != tile::Role::Radar || !blends) return reduction;
  const tile::RadarScale usual = tile::usual_radar_scale(is_floating(sources.type.sample));
  reduction.power = options.radar_scale.value_or(usual) == tile::RadarScale::Decibel;
  for (int b = 0; b < sources.type.data_bands(); ++b) {
    reduction.scale.push_back(sources.bands[static_cast<std::size_t>(b)].scale);
    reduction.offset.push_back(sources.bands[static_cast<std::size_t>(b)].offset);
  }
  return reduction;
}

std::string describe(const Reduction& reduction) {
  return fmt::format("{}{}", to_string(reduction.filter), reduction.power ? " of power" : "");
}

Result<TileCodec> choose_codec(const BuildOptions& options, std::optional<tile::Role> role, const Sources& sources,
                               const mosaic::TexelType& type) {
  const Compression codec = options.compression;
  const auto refuse_samples = [&](const std::string& why) {
    return refuse(
        fmt::format("{}: {}; choose --compress zstd, or other --bands", sources.rasters.front()->label(), why));
  };
  const bool labels = role == tile::Role::Labels || !sources.palette.empty();
  if (is_lossy(options) && labels)
    return refuse_samples(fmt::format("{} blends neighbours, and its samples are labels", to_string(codec)));
  const bool bytes = type.sample == mosaic::Sample::U8;
  if (codec == Compression::Jpeg && (!bytes || (type.bands != 1 && type.bands != 3)))
    return refuse_samples(
        fmt::format("jpeg stores 1 or 3 bands of 8 bits, found {} of type {}", type.bands, name_of(type.sample)));
  if (codec == Compression::Webp && (!bytes || (type.bands != 3 && !(type.alpha && type.bands == 4))))
    return refuse_samples(
        fmt::format("webp stores 3 bands of 8 bits, and alpha, found {} of type {}", type.bands, name_of(type.sample)));
  if (codec == Compression::Lerc && (type.sample == mosaic::Sample::U64 || type.sample == mosaic::Sample::I64))
    return refuse_samples(
        fmt::format("lerc stores samples of up to 32 bits and doubles, found {}", name_of(type.sample)));

  TileCodec chosen;
  tiff::TileFormat& format = chosen.imagery;
  format.tile_width = format.tile_height = static_cast<std::uint32_t>(options.tile_size);
  format.samples = static_cast<std::uint32_t>(type.bands);
  format.bits = static_cast<std::uint32_t>(8 * tiff::size_bytes(type.sample));
  format.number = is_floating(type.sample) ? tiff::Number::Float
                  : tiff::with_sample(type.sample, [](auto s) { return std::is_signed_v<decltype(s)>; })
                      ? tiff::Number::Signed
                      : tiff::Number::Unsigned;
  format.codec = codec_of(codec);
  format.predictor = options.predictor.value_or(usual_predictor(options, labels, type.sample));
  format.photometric = photometric_of(sources);
  if (codec == Compression::Lerc) format.lerc_packing = 2;
  const int colors = format.photometric == tiff::Photometric::Rgb ? 3 : 1;
  for (int b = colors; b < type.bands; ++b) chosen.extra_samples.push_back(type.alpha && b + 1 == type.bands ? 2 : 0);
  if (type.mask) {
    tiff::TileFormat mask;
    mask.tile_width = mask.tile_height = format.tile_width;
    mask.bits = 1;
    mask.codec = tiff::Codec::Deflate;
    mask.photometric = tiff::Photometric::TransparencyMask;
    chosen.mask = mask;
  }
  constexpr int level_of_labels = 15;  // a seventh smaller, and decoded as fast
  const int level = labels && codec == Compression::Zstd ? level_of_labels : 0;
  chosen.packing = {options.level.value_or(level), options.quality.value_or(90), options.subsample_chroma,
                    options.max_error};
  return chosen;
}

int choose_depth(const mosaic::Mosaic& mosaic, int tile_size) {
  constexpr std::int64_t chunk_bytes = 16 << 20, enough_chunks = 16;
  const auto texel_bytes = static_cast<std::int64_t>(mosaic.type().texel_bytes());
  const auto fits = [&](int depth) {
    const std::int64_t side = std::int64_t{tile_size} << depth;
    const std::int64_t cols = (mosaic.width() - 1) / side + 1, rows = (mosaic.height() - 1) / side + 1;
    return side * side * texel_bytes <= chunk_bytes && cols * rows >= enough_chunks;
  };
  int depth = 1;
  while (depth < 4 && fits(depth + 1)) ++depth;
  return depth;
}

}  // namespace nadir::pyramid

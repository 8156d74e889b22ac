#include "codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

namespace nadir::pyramid {
namespace {

constexpr int default_quality = 90;

tl::unexpected<Error> refuse(const Mosaic& mosaic, const std::string& why) {
  return fail(Error::Kind::Unsupported,
              fmt::format("{}: {}; choose --compress zstd, or other --bands", mosaic.sources.front().label, why));
}

Result<void> check_lossy(const BuildOptions& options, const Mosaic& mosaic) {
  const Compression codec = options.compression;
  const bool pictures = codec == Compression::Jpeg || codec == Compression::Webp;
  if (options.quality && !pictures)
    return fail(Error::Kind::Unsupported,
                fmt::format("quality {}: {} has none, it is for jpeg and webp", *options.quality, to_string(codec)));
  if (options.quality && (*options.quality < 1 || *options.quality > 100))
    return fail(Error::Kind::Malformed, fmt::format("quality {}: expected 1 to 100", *options.quality));
  if (!(options.max_error >= 0) || (options.max_error > 0 && codec != Compression::Lerc))
    return fail(Error::Kind::Unsupported,
                fmt::format("largest error {}: it is for lerc, and at least 0", options.max_error));

  const bool lossy =
      codec == Compression::Jpeg || (codec == Compression::Webp && options.quality != 100) || options.max_error > 0;
  const bool palette = mosaic.sources.front().description.bands.front().color == "Palette";
  if (lossy && (palette || options.role == tile::Role::Labels))
    return refuse(mosaic, fmt::format("{} blends neighbours, and its samples are labels", to_string(codec)));
  return {};
}

}  // namespace

Result<CPLStringList> codec_options(const BuildOptions& options, const Mosaic& mosaic) {
  if (const auto ok = check_lossy(options, mosaic); !ok) return fail(ok);
  const GDALDataType type = mosaic.sources.front().type;
  const std::string type_name = GDALGetDataTypeName(type);
  const bool alpha = mosaic.sources.front().alpha && !mosaic.mask;
  const int colors = mosaic.band_count - (alpha ? 1 : 0);
  CPLStringList creation;
  const int quality = options.quality.value_or(default_quality);
  // GDAL's COG driver takes the levels' quality from an option of their own, lossy where it is not set.
  const auto set_quality = [&] {
    for (const char* option : {"QUALITY", "OVERVIEW_QUALITY"})
      creation.SetNameValue(option, std::to_string(quality).c_str());
  };
  switch (options.compression) {
    case Compression::None:
      break;
    case Compression::Deflate:
    case Compression::Zstd:
    case Compression::Lzw:
      // Differences between neighbours compress better where neighbours are alike, which labels are not.
      if (options.role != tile::Role::Labels) creation.SetNameValue("PREDICTOR", "YES");
      break;
    case Compression::Jpeg:
      if (type != GDT_Byte || (colors != 1 && colors != 3))
        return refuse(mosaic,
                      fmt::format("jpeg stores 1 or 3 bands of 8 bits, found {} of type {}", colors, type_name));
      set_quality();
      break;
    case Compression::Webp:
      if (type != GDT_Byte || (mosaic.band_count != 3 && !(alpha && mosaic.band_count == 4)))
        return refuse(mosaic,
                      fmt::format("webp stores 3 bands of 8 bits, and alpha, found {} of type {}", colors, type_name));
      set_quality();
      break;
    case Compression::Lerc:
      if (type == GDT_Int64 || type == GDT_UInt64)
        return refuse(mosaic, fmt::format("lerc stores samples of up to 32 bits and doubles, found {}", type_name));
      creation.SetNameValue("MAX_Z_ERROR", fmt::format("{}", options.max_error).c_str());
      break;
  }

  std::string name(to_string(options.compression));
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const char* known = GetGDALDriverManager()->GetDriverByName("COG")->GetMetadataItem(GDAL_DMD_CREATIONOPTIONLIST);
  if (!known || std::string_view(known).find(fmt::format("<Value>{}</Value>", name)) == std::string_view::npos)
    return fail(Error::Kind::Unsupported,
                fmt::format("compression {}: this GDAL was built without it; choose another, deflate is always there",
                            to_string(options.compression)));
  creation.SetNameValue("COMPRESS", name.c_str());
  return creation;
}

}  // namespace nadir::pyramid

#include <fmt/format.h>

#include <array>

#include "nadir/base/text.h"
#include "nadir/gdal/dataset.h"
#include "nadir/gdal/describe.h"
#include "nadir/gdal/raster.h"

namespace nadir::gdal {
using tile::Level, tile::MapDescription, tile::Raster, tile::SampleType, tile::Texels, tile::ValiditySource,
    tile::Window;
namespace {

/// GDAL decodes whole blocks, and a header may claim any size for them.
constexpr std::uint64_t largest_block_bytes = 256ull << 20;

/// What GDAL holds of one sample's place when it decodes a block: of all bands, where they are stored interleaved.
std::uint64_t bytes_decoded_at_once(GDALDataset& dataset) {
  const char* interleave = dataset.GetMetadataItem("INTERLEAVE", "IMAGE_STRUCTURE");
  const bool together = interleave && std::string_view(interleave) == "PIXEL";
  const auto sample =
      static_cast<std::uint64_t>(GDALGetDataTypeSizeBytes(dataset.GetRasterBand(1)->GetRasterDataType()));
  return together ? sample * static_cast<std::uint64_t>(dataset.GetRasterCount()) : sample;
}

GDALDataType gdal_type(SampleType type) {
  static constexpr std::array types = {GDT_Byte, GDT_Int16, GDT_UInt16, GDT_Float32};
  return types[static_cast<std::size_t>(type)];
}

class GdalRaster : public Raster {
 public:
  GdalRaster(MapDescription description, std::vector<int> overview_of_level, Dataset first)
      : Raster(std::move(description)),
        overview_of_level_(std::move(overview_of_level)),
        pool_(this->description().path, std::move(first)) {}

  Result<Texels> read(int level, const Window& window, std::span<const int> bands, SampleType type) const override {
    auto dataset = pool_.borrow();
    if (!dataset) return fail(dataset);
    Texels texels{type, static_cast<int>(bands.size()), window, {}, {}};
    const std::size_t area = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
    const std::size_t sample = size_bytes(type), texel = sample * bands.size();
    texels.samples.resize(area * texel);

    GdalMessages messages;
    CPLErr status = CE_None;
    for (std::size_t b = 0; b < bands.size() && status == CE_None; ++b) {
      status =
          band(**dataset, level, bands[b])
              .RasterIO(GF_Read, window.x, window.y, window.width, window.height, texels.samples.data() + b * sample,
                        window.width, window.height, gdal_type(type), static_cast<GSpacing>(texel),
                        static_cast<GSpacing>(texel * static_cast<std::size_t>(window.width)), nullptr);
    }
    const bool masked =
        description().validity == ValiditySource::Mask || description().validity == ValiditySource::Alpha;
    if (masked) texels.validity.assign(area, 1);
    std::vector<std::uint8_t> mask(masked ? area : 0);
    for (std::size_t b = 0; b < bands.size() && status == CE_None && masked; ++b) {
      GDALRasterBand& source = band(**dataset, level, bands[b]);
      status = source.GetMaskBand()->RasterIO(GF_Read, window.x, window.y, window.width, window.height, mask.data(),
                                              window.width, window.height, GDT_Byte, 0, 0, nullptr);
      for (std::size_t i = 0; i < area; ++i) texels.validity[i] = texels.validity[i] && mask[i] >= 128;
      if (source.GetMaskFlags() & GMF_PER_DATASET) break;  // the same one for all bands
    }
    pool_.give_back(std::move(*dataset));
    if (status != CE_None || messages.failed())
      return fail(Error::Kind::Damaged,
                  fmt::format("{}: level {}, texels {} to {} by {} to {} cannot be read: {}; if the file is damaged, "
                              "fetch or build it again",
                              description().path, level, window.x, window.x + window.width, window.y,
                              window.y + window.height, without_path(messages.first(), description().path)));
    return texels;
  }

 private:
  GDALRasterBand& band(GDALDataset& dataset, int level, int number) const {
    GDALRasterBand* full = dataset.GetRasterBand(number);
    return level == 0 ? *full : *full->GetOverview(overview_of_level_[static_cast<std::size_t>(level) - 1]);
  }

  const std::vector<int> overview_of_level_;  // from level 1 on
  mutable DatasetPool pool_;
};

}  // namespace

Result<MapDescription> describe_by_gdal(const std::string& path) {
  auto dataset = open_raster(path);
  if (!dataset) return fail(dataset);
  const GdalMessages messages;
  std::vector<int> overview_of_level;
  MapDescription map = describe_dataset(**dataset, path, overview_of_level);
  if (!messages.first().empty()) map.warnings.push_back(without_path(messages.first(), path));
  return map;
}

Result<std::unique_ptr<Raster>> open_gdal_raster(const std::string& path) {
  auto dataset = open_raster(path);
  if (!dataset) return fail(dataset);
  const GdalMessages messages;
  std::vector<int> overview_of_level;
  MapDescription description = describe_dataset(**dataset, path, overview_of_level);
  if (!description.georeference)
    return fail(Error::Kind::Malformed,
                fmt::format("{}: expected a georeferenced raster, found {}", path, description.georeference_problem));
  // GDAL goes on where it cannot read where tiles lie, and then reads zeros.
  if (messages.failed())
    return fail(Error::Kind::Malformed,
                fmt::format("{}: expected whole headers: {}; the file is damaged: fetch or build it again", path,
                            without_path(messages.first(), path)));

  const std::uint64_t texel_bytes = bytes_decoded_at_once(**dataset);
  for (const Level& level : description.levels) {
    const std::uint64_t bytes = static_cast<std::uint64_t>(level.tile_width) * level.tile_height * texel_bytes;
    if (bytes > largest_block_bytes)
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: stored in blocks of {} x {} texels, {} each, and a view would decode whole ones; "
                              "store it in tiles with gdal_translate -co TILED=YES",
                              path, level.tile_width, level.tile_height, format_bytes(bytes)));
  }
  return std::make_unique<GdalRaster>(std::move(description), std::move(overview_of_level), std::move(*dataset));
}

}  // namespace nadir::gdal

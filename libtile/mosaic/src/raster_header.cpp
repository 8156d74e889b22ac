#include "raster_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>

#include "nadir/base/text.h"
#include "nadir/gdal/dataset.h"
#include "nadir/gdal/describe.h"
#include "nadir/tiff/decode.h"
#include "sample_types.h"

namespace nadir::mosaic {
namespace {

/// What a reader has to hold to read any texel, of a raster that is not stored for that.
constexpr std::uint64_t largest_block_bytes = 1ull << 30;

Metadata metadata_of(GDALMajorObject& object) {
  Metadata metadata;
  for (char** item = object.GetMetadata(); item && *item; ++item) {
    char* key = nullptr;
    const char* value = CPLParseNameValue(*item, &key);
    if (key && value) metadata.emplace_back(key, value);
    CPLFree(key);
  }
  return metadata;
}

Palette palette_of(GDALRasterBand& band) {
  Palette palette;
  const GDALColorTable* table = band.GetColorTable();
  if (!table || band.GetColorInterpretation() != GCI_PaletteIndex) return palette;
  for (int i = 0; i < table->GetColorEntryCount(); ++i) {
    GDALColorEntry color = {};
    table->GetColorEntryAsRGB(i, &color);
    const auto byte = [](short value) { return static_cast<std::uint8_t>(std::clamp<int>(value, 0, 255)); };
    palette.push_back({byte(color.c1), byte(color.c2), byte(color.c3), byte(color.c4)});
  }
  return palette;
}

Result<BandHeader> read_band(GDALRasterBand& band, const tile::Band& described, const std::string& label) {
  BandHeader header;
  const auto sample = sample_of(described.stored_type);
  if (!sample)
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: band {} has type {}, which no map holds; convert it with gdal_translate -ot", label,
                            band.GetBand(), described.stored_type));
  header.sample = *sample;
  header.complex = is_complex(described.stored_type);
  if (described.nodata) header.nodata = nodata_held(*sample, *described.nodata);
  header.palette = palette_of(band);
  header.metadata = metadata_of(band);
  std::erase_if(header.metadata, [](const auto& item) { return item.first.starts_with("STATISTICS_"); });
  for (char** name = band.GetCategoryNames(); name && *name; ++name) header.categories.emplace_back(*name);
  return header;
}

bool has_external_mask(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(path + ".msk", error) || std::filesystem::exists(path + ".MSK", error);
}

/// Empty where GDAL reads something else than what lies in the tiles, or where they are not decoded here.
std::optional<TiffLayout> find_layout(const RasterHeader& header) {
  if (!header.file.on_disk || header.description.format != "GTiff" || header.every_band_masked) return std::nullopt;
  auto bytes = LocalFile::open(header.file.path);
  if (!bytes) return std::nullopt;
  const auto file = tiff::TiffFile::open(std::move(*bytes));
  if (!file) return std::nullopt;
  const auto& directories = (*file)->directories();
  const tile::Level& size = header.description.levels.front();
  const auto fits = [&](const tiff::Directory& d) {
    return d.width == static_cast<std::uint32_t>(size.width) && d.height == static_cast<std::uint32_t>(size.height);
  };
  TiffLayout layout;
  layout.image_directory = directories.front();
  const tiff::TileFormat& format = layout.image_directory.format;
  if (!fits(layout.image_directory) || format.samples != header.bands.size()) return std::nullopt;
  for (const BandHeader& band : header.bands)
    if (band.complex || band.sample != tiff::decoded_sample(format)) return std::nullopt;
  const auto without_places = [](tiff::Directory& directory) {
    directory.fields.clear();
    directory.offsets = directory.byte_counts = {};
  };
  without_places(layout.image_directory);

  if (!header.masked) return layout;
  if (has_external_mask(header.file.path)) return std::nullopt;
  for (std::uint32_t i = 1; i < directories.size(); ++i) {
    const tiff::Directory& mask = directories[i];
    if (!mask.mask || mask.reduced || !fits(mask)) continue;
    if (mask.format.samples != 1 || mask.format.bits > 8 || mask.format.number != tiff::Number::Unsigned)
      return std::nullopt;
    layout.mask = i;
    layout.mask_directory = mask;
    without_places(layout.mask_directory);
    return layout;
  }
  return std::nullopt;
}

/// GDAL decodes whole blocks, and a header may claim any size for them.
Result<void> check_block_size(const RasterHeader& header, GDALDataset& dataset) {
  const tile::Level& size = header.description.levels.front();
  const char* interleave = dataset.GetMetadataItem("INTERLEAVE", "IMAGE_STRUCTURE");
  const bool together = interleave && std::string_view(interleave) == "PIXEL";
  const auto sample =
      static_cast<std::uint64_t>(GDALGetDataTypeSizeBytes(dataset.GetRasterBand(1)->GetRasterDataType()));
  const std::uint64_t bytes = static_cast<std::uint64_t>(size.tile_width) *
                              static_cast<std::uint64_t>(size.tile_height) * sample *
                              (together ? header.bands.size() : 1);
  if (bytes <= largest_block_bytes) return {};
  return fail(Error::Kind::Unsupported,
              fmt::format("{}: stored in blocks of {} x {} texels, {} each, which are decoded whole; store it in tiles "
                          "first, with gdal_translate -co TILED=YES",
                          header.file.label, size.tile_width, size.tile_height, format_bytes(bytes)));
}

}  // namespace

Result<RasterHeader> read_header(const NamedRaster& raster) {
  RasterHeader header;
  header.file = SourceFile::look_at(raster.path, raster.label);
  header.memory = raster.memory;
  auto dataset = open_dataset(raster.path);
  if (!dataset) {
    if (!raster.memory && raster.path == raster.label) return fail(dataset);
    return fail(dataset.error().kind,
                fmt::format("{}: {}", raster.label, gdal::without_path(dataset.error().message, raster.path)));
  }
  const gdal::GdalMessages messages;
  std::vector<int> unused_overviews;
  header.description = gdal::describe_dataset(**dataset, raster.label, unused_overviews);
  if (header.description.acquired.empty())
    if (const char* acquired = (*dataset)->GetMetadataItem("ACQUISITIONDATETIME", "IMAGERY"))
      header.description.acquired = acquired;
  for (int b = 1; b <= (*dataset)->GetRasterCount(); ++b) {
    auto band = read_band(*(*dataset)->GetRasterBand(b), header.description.bands[static_cast<std::size_t>(b) - 1],
                          raster.label);
    if (!band) return fail(band);
    header.bands.push_back(std::move(*band));
  }
  header.metadata = metadata_of(**dataset);
  std::erase_if(header.metadata, [&](const auto& item) {
    if (item.first == "AREA_OR_POINT") header.pixel_is_point = item.second == "Point";
    return item.first == "AREA_OR_POINT" || item.first == "OVR_RESAMPLING_ALG";
  });
  header.masked = header.description.validity == tile::ValiditySource::Mask;
  header.every_band_masked = header.masked && !((*dataset)->GetRasterBand(1)->GetMaskFlags() & GMF_PER_DATASET);
  // GDAL goes on where it cannot read where tiles lie, and then reads zeros.
  if (messages.failed())
    return fail(Error::Kind::Malformed,
                fmt::format("{}: expected whole headers: {}; the file is damaged: fetch or build it again",
                            raster.label, gdal::without_path(messages.first(), raster.path)));
  header.tiff = find_layout(header);
  if (!header.tiff)
    if (auto ok = check_block_size(header, **dataset); !ok) return fail(ok);
  return header;
}

}  // namespace nadir::mosaic

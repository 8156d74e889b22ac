#include "mosaic.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "virtual_source.h"

namespace nadir::pyramid {
namespace {

using tile::ValiditySource;

/// Metadata on which all sources agree, without what describes their files rather than their contents.
Result<std::vector<std::pair<std::string, std::string>>> common_metadata(const std::vector<Source>& sources) {
  std::vector<std::pair<std::string, std::string>> common;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    auto dataset = gdal::open_raster(sources[i].path);
    if (!dataset) return fail(dataset);
    if (i == 0) {
      for (char** item = (*dataset)->GetMetadata(); item && *item; ++item) {
        char* key = nullptr;
        const char* value = CPLParseNameValue(*item, &key);
        if (key && value && std::string_view(key) != "OVR_RESAMPLING_ALG") common.emplace_back(key, value);
        CPLFree(key);
      }
    }
    std::erase_if(common, [&](const auto& item) {
      const char* value = (*dataset)->GetMetadataItem(item.first.c_str());
      return !value || value != item.second;
    });
  }
  return common;
}

/// Names, colours and units as the first source has them. Statistics are left out: they would be of one source.
void copy_band_properties(GDALRasterBand& from, GDALRasterBand& to, bool keep_nodata) {
  to.SetDescription(from.GetDescription());
  to.SetColorInterpretation(from.GetColorInterpretation());
  if (GDALColorTable* colors = from.GetColorTable()) to.SetColorTable(colors);
  if (char** names = from.GetCategoryNames()) to.SetCategoryNames(names);
  if (*from.GetUnitType()) to.SetUnitType(from.GetUnitType());
  int there = 0;
  if (const double scale = from.GetScale(&there); there && scale != 1) to.SetScale(scale);
  if (const double offset = from.GetOffset(&there); there && offset != 0) to.SetOffset(offset);
  for (char** item = from.GetMetadata(); item && *item; ++item) {
    char* key = nullptr;
    const char* value = CPLParseNameValue(*item, &key);
    if (key && value && !std::string_view(key).starts_with("STATISTICS_")) to.SetMetadataItem(key, value);
    CPLFree(key);
  }
  if (!keep_nodata) return;
  switch (from.GetRasterDataType()) {
    case GDT_Int64:
      if (const auto nodata = from.GetNoDataValueAsInt64(&there); there) to.SetNoDataValueAsInt64(nodata);
      break;
    case GDT_UInt64:
      if (const auto nodata = from.GetNoDataValueAsUInt64(&there); there) to.SetNoDataValueAsUInt64(nodata);
      break;
    default:
      if (const double nodata = from.GetNoDataValue(&there); there) to.SetNoDataValue(nodata);
  }
}

std::string overviews_xml(std::span<const std::filesystem::path> levels, int band) {
  std::string xml;
  for (const auto& level : levels)
    xml += fmt::format(
        "<Overview><SourceFilename relativeToVRT=\"0\">{}</SourceFilename><SourceBand>{}</SourceBand></Overview>\n",
        xml_escaped(level.string()), band);
  return xml;
}

/// What of a source's band does not cover the sources below it.
std::string see_through(const Mosaic& mosaic, const Source& source, int band) {
  if (mosaic.sources.size() == 1) return {};
  const tile::Band& b = source.description.bands[static_cast<std::size_t>(band) - 1];
  if (b.color == "Alpha") return "<NODATA>0</NODATA>";
  if (b.nodata) return fmt::format("<NODATA>{:.17g}</NODATA>", *b.nodata);
  if (source.description.validity != ValiditySource::None) return "<UseMaskBand>true</UseMaskBand>";
  return {};
}

}  // namespace

Result<Mosaic> lay_out(std::vector<Source> sources, bool alpha_to_mask) {
  Mosaic mosaic;
  const Source& first = sources.front();
  const Eigen::Affine2d texel_from_crs = first.description.georeference->crs_from_texel.inverse();
  std::int64_t left = 0, top = 0, right = 0, bottom = 0;
  std::vector<std::pair<std::int64_t, std::int64_t>> corners;
  for (const Source& source : sources) {
    const Eigen::Vector2d corner = texel_from_crs * source.description.georeference->crs_from_texel.translation();
    if (!(corner.cwiseAbs().maxCoeff() < std::numeric_limits<int>::max()))
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: lies further from {} than a raster can span", source.label, first.label));
    const std::int64_t x = std::llround(corner.x()), y = std::llround(corner.y());
    const double shift =
        std::max(std::abs(corner.x() - static_cast<double>(x)), std::abs(corner.y() - static_cast<double>(y)));
    if (shift > 0.05)
      mosaic.warnings.push_back(
          fmt::format("{} was moved by {:.2f} texels onto the grid of {}", source.label, shift, first.label));
    corners.emplace_back(x, y);
    left = std::min(left, x);
    top = std::min(top, y);
    right = std::max(right, x + source.description.levels.front().width);
    bottom = std::max(bottom, y + source.description.levels.front().height);
  }
  if (std::max(right - left, bottom - top) > std::numeric_limits<int>::max())
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: the sources span {} x {} texels, more than a raster can have", first.label,
                            right - left, bottom - top));
  mosaic.width = static_cast<int>(right - left);
  mosaic.height = static_cast<int>(bottom - top);
  for (const auto& [x, y] : corners) mosaic.corners.emplace_back(static_cast<int>(x - left), static_cast<int>(y - top));

  // Gaps between sources, and sources that tell validity in different ways, need a mask band.
  const auto every_source_has = [&](ValiditySource kind) {
    return std::all_of(sources.begin(), sources.end(), [&](const Source& s) { return s.description.validity == kind; });
  };
  if (first.alpha)
    mosaic.mask = alpha_to_mask;
  else
    mosaic.mask =
        !every_source_has(ValiditySource::Nodata) && !(sources.size() == 1 && every_source_has(ValiditySource::None));
  mosaic.band_count = static_cast<int>(first.bands.size()) - (first.alpha && alpha_to_mask ? 1 : 0);

  auto metadata = common_metadata(sources);
  if (!metadata) return fail(metadata);
  mosaic.metadata = std::move(*metadata);
  mosaic.sources = std::move(sources);
  return mosaic;
}

Result<gdal::Dataset> open_mosaic(const Mosaic& mosaic, std::span<const std::filesystem::path> levels) {
  const Source& first = mosaic.sources.front();
  const auto piece = [&](std::size_t i, std::string band, std::string rule) {
    const Source& source = mosaic.sources[i];
    const tile::Level& size = source.description.levels.front();
    return VirtualSource{source.path, std::move(band),         GDALGetDataTypeName(source.type), size.width,
                         size.height, mosaic.corners[i].first, mosaic.corners[i].second,         std::move(rule)}
        .xml();
  };

  const Eigen::Affine2d& grid = first.description.georeference->crs_from_texel;
  const Eigen::Vector2d origin = grid * Eigen::Vector2d(-mosaic.corners[0].first, -mosaic.corners[0].second);
  std::string xml = fmt::format(
      "<VRTDataset rasterXSize=\"{}\" rasterYSize=\"{}\">\n<GeoTransform>{:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, "
      "{:.17g}</GeoTransform>\n",
      mosaic.width, mosaic.height, origin.x(), grid(0, 0), grid(0, 1), origin.y(), grid(1, 0), grid(1, 1));
  for (int b = 1; b <= mosaic.band_count; ++b) {
    const int number = first.bands[static_cast<std::size_t>(b) - 1];
    xml += fmt::format("<VRTRasterBand dataType=\"{}\" band=\"{}\">\n", GDALGetDataTypeName(first.type), b);
    for (std::size_t i = 0; i < mosaic.sources.size(); ++i)
      xml += piece(i, std::to_string(number), see_through(mosaic, mosaic.sources[i], number));
    xml += overviews_xml(levels, b) + "</VRTRasterBand>\n";
  }
  if (mosaic.mask) {
    xml += "<MaskBand><VRTRasterBand dataType=\"Byte\">\n";
    for (std::size_t i = 0; i < mosaic.sources.size(); ++i) {
      // A mask knows 0 and 255 only: alpha counts as seen from half on, as for a reader of the map.
      static constexpr auto from_half = "<NODATA>0</NODATA><LUT>0:0,127:0,128:255,255:255</LUT>";
      const Source& source = mosaic.sources[i];
      xml += source.alpha ? piece(i, std::to_string(source.bands.back()), from_half)
                          : piece(i, "mask,1", "<NODATA>0</NODATA>");
    }
    xml += "</VRTRasterBand></MaskBand>\n";
  }
  xml += "</VRTDataset>\n";

  auto dataset = gdal::open_raster(xml);
  if (!dataset)
    return fail(Error::Kind::Malformed, fmt::format("{}: cannot be read as a mosaic: {}", first.label,
                                                    dataset.error().message.substr(xml.size())));
  auto properties = gdal::open_raster(first.path);
  if (!properties) return fail(properties);
  const gdal::GdalMessages messages;
  (*dataset)->SetSpatialRef((*properties)->GetSpatialRef());
  for (const auto& [key, value] : mosaic.metadata) (*dataset)->SetMetadataItem(key.c_str(), value.c_str());
  for (int b = 1; b <= mosaic.band_count; ++b)
    copy_band_properties(*(*properties)->GetRasterBand(first.bands[static_cast<std::size_t>(b) - 1]),
                         *(*dataset)->GetRasterBand(b), !mosaic.mask);
  return dataset;
}

}  // namespace nadir::pyramid

#include "describe_tiff.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <pugixml.hpp>

#include "nadir/base/text.h"
#include "nadir/tiff/decode.h"
#include "nadir/tile/raster.h"
#include "tiff_tiles.h"

namespace nadir::tile {
namespace {

using tiff::Directory, tiff::Field, tiff::Photometric, tiff::Sample, tiff::TileFormat;

tl::unexpected<Error> unsupported(const tiff::TiffFile& file, std::string_view what) {
  return fail(Error::Kind::Unsupported, fmt::format("{}: {}", file.source().name(), what));
}

/// A number as writers of nodata spell it: "-9999", "nan", "-inf".
std::optional<double> parse_any_number(std::string_view text) {
  text = trim(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// What GDAL adds to a TIFF's own fields, as XML.
struct Metadata {
  std::map<std::string, std::string> items;  // of the whole file
  struct Item {
    std::size_t band;
    std::string role, value;
  };
  std::vector<Item> of_bands;
};

/// GDAL escapes values before they become XML, which escapes them again.
std::string unescaped_again(const std::string& value) {
  pugi::xml_document document;
  return document.load_string(("<v>" + value + "</v>").c_str(), pugi::parse_default | pugi::parse_ws_pcdata)
             ? document.child("v").text().get()
             : value;
}

Result<Metadata> read_metadata(const tiff::TiffFile& file, const Directory& directory) {
  Metadata metadata;
  const Field* field = directory.field(tiff::tag::gdal_metadata);
  if (!field) return metadata;
  const auto text = file.text(*field);
  if (!text) return fail(text);
  pugi::xml_document document;
  if (!document.load_string(text->c_str())) return unsupported(file, "its GDAL metadata are not XML");
  for (const pugi::xml_node item : document.child("GDALMetadata").children("Item")) {
    const std::string role = item.attribute("role").value(), value = unescaped_again(item.text().get());
    if (item.attribute("sample"))
      metadata.of_bands.push_back({item.attribute("sample").as_uint(), role, value});
    else if (!item.attribute("domain"))
      metadata.items[item.attribute("name").value()] = value;
  }
  return metadata;
}

std::string_view stored_type(const TileFormat& format) {
  static constexpr std::array<std::string_view, 10> names = {"Byte",  "Int8",   "UInt16", "Int16",   "UInt32",
                                                             "Int32", "UInt64", "Int64",  "Float32", "Float64"};
  return names[static_cast<std::size_t>(tiff::decoded_sample(format))];
}

std::string color_of(const Directory& directory, std::size_t band) {
  const TileFormat& format = directory.format;
  const std::size_t colors = format.samples - directory.extra_samples.size();
  if (band >= colors && (directory.extra_samples[band - colors] == 1 || directory.extra_samples[band - colors] == 2))
    return "Alpha";
  static constexpr std::array<const char*, 3> rgb = {"Red", "Green", "Blue"};
  switch (format.photometric) {
    case Photometric::Rgb:
    case Photometric::YCbCr:
      return band < 3 ? rgb[band] : "Undefined";
    case Photometric::Palette:
      return band == 0 ? "Palette" : "Undefined";
    default:
      return band == 0 ? "Gray" : "Undefined";
  }
}

Result<std::vector<Band>> describe_bands(const tiff::TiffFile& file, const Metadata& metadata) {
  const Directory& directory = file.directories().front();
  std::optional<double> nodata;
  if (const Field* field = directory.field(tiff::tag::gdal_nodata)) {
    const auto text = file.text(*field);
    if (!text) return fail(text);
    nodata = parse_any_number(*text);
    if (!nodata) return unsupported(file, fmt::format("nodata value '{}'", *text));
  }
  std::vector<Band> bands(directory.format.samples);
  for (std::size_t b = 0; b < bands.size(); ++b) {
    bands[b].stored_type = stored_type(directory.format);
    bands[b].sample_type = held_as(tiff::decoded_sample(directory.format));
    bands[b].nodata = nodata;
    bands[b].color = color_of(directory, b);
  }
  for (const Metadata::Item& item : metadata.of_bands) {
    if (item.band >= bands.size()) continue;
    Band& band = bands[item.band];
    const auto number = parse_any_number(item.value);
    if (item.role == "description") band.name = item.value;
    if (item.role == "unittype") band.unit = item.value;
    if (item.role == "colorinterp") band.color = item.value;
    if (item.role == "scale" && number) band.scale = *number;
    if (item.role == "offset" && number) band.offset = *number;
  }
  return bands;
}

/// The CRS's code, from the keys of GeoTIFF 1.1 section 7; only those with a closed form, and nothing that could change
/// what the code says.
std::optional<int> crs_code(const std::vector<double>& keys, bool& pixel_is_point) {
  enum Key {
    ModelType = 1024,
    RasterType = 1025,
    Citation = 1026,
    Geographic = 2048,
    GeographicCitation = 2049,
    AngularUnits = 2054,
    Projected = 3072,
    ProjectedCitation = 3073,
    LinearUnits = 3076,
    SemiMajorAxis = 2057,
    InverseFlattening = 2059
  };
  if (std::any_of(keys.begin(), keys.end(), [](double k) { return !(k >= 0 && k < 65536); })) return std::nullopt;
  if (keys.size() < 4 || static_cast<double>(keys.size()) < 4 + 4 * keys[3]) return std::nullopt;
  int model = 0, geographic = 0, projected = 0;
  for (std::size_t i = 4; i + 3 < 4 + 4 * static_cast<std::size_t>(keys[3]); i += 4) {
    const int key = static_cast<int>(keys[i]), value = static_cast<int>(keys[i + 3]);
    const bool inside = keys[i + 1] == 0;
    switch (key) {
      case Citation:
      case GeographicCitation:
      case ProjectedCitation:
      case SemiMajorAxis:
      case InverseFlattening:
        break;
      case ModelType:
        model = value;
        break;
      case RasterType:
        pixel_is_point = value == 2;
        break;
      case Geographic:
        geographic = value;
        break;
      case Projected:
        projected = value;
        break;
      case AngularUnits:
        if (!inside || value != 9102) return std::nullopt;  // degrees
        break;
      case LinearUnits:
        if (!inside || value != 9001) return std::nullopt;  // metres
        break;
      default:
        return std::nullopt;
    }
  }
  if (model == 2 && geographic == 4326 && projected == 0) return 4326;
  if (model == 1 && projected != 4326 && geodesy::has_closed_form(projected) && (geographic == 0 || geographic == 4326))
    return projected;
  return std::nullopt;
}

Result<Georeference> describe_place(const tiff::TiffFile& file) {
  const Directory& directory = file.directories().front();
  const Field* keys = directory.field(tiff::tag::geo_keys);
  if (!keys || directory.field(tiff::tag::rational_coefficients)) return unsupported(file, "no plain georeference");
  const auto values = file.numbers(*keys);
  if (!values) return fail(values);
  bool pixel_is_point = false;
  const auto code = crs_code(*values, pixel_is_point);
  if (!code) return unsupported(file, "a CRS without a closed form");

  Georeference where;
  where.crs = where.definition = fmt::format("EPSG:{}", *code);
  const Field* scale = directory.field(tiff::tag::model_pixel_scale);
  const Field* ties = directory.field(tiff::tag::model_tie_points);
  const Field* matrix = directory.field(tiff::tag::model_transformation);
  if (scale && ties && !matrix) {
    const auto s = file.numbers(*scale), t = file.numbers(*ties);
    if (!s) return fail(s);
    if (!t) return fail(t);
    if (s->size() < 2 || t->size() != 6 || !((*s)[0] > 0) || !((*s)[1] > 0))
      return unsupported(file, "no plain georeference");
    const double dx = (*s)[0], dy = -(*s)[1];
    where.crs_from_texel.matrix() << dx, 0, (*t)[3] - (*t)[0] * dx, 0, dy, (*t)[4] - (*t)[1] * dy, 0, 0, 1;
  } else if (matrix && !scale) {
    const auto m = file.numbers(*matrix);
    if (!m) return fail(m);
    if (m->size() != 16) return unsupported(file, "no plain georeference");
    where.crs_from_texel.matrix() << (*m)[0], (*m)[1], (*m)[3], (*m)[4], (*m)[5], (*m)[7], 0, 0, 1;
  } else {
    return unsupported(file, "no plain georeference");
  }
  const double area = where.crs_from_texel.linear().determinant();
  if (!where.crs_from_texel.matrix().allFinite() || !(std::abs(area) > 1e-300))
    return unsupported(file, "a geotransform without area");
  // The centre of the first texel, not its corner, is where it says.
  if (pixel_is_point) where.crs_from_texel.translate(Eigen::Vector2d(-0.5, -0.5));
  return where;
}

}  // namespace

Result<MapDescription> describe_tiff(const tiff::TiffFile& file) {
  const auto& directories = file.directories();
  const Directory& full = directories.front();
  if (full.reduced || full.mask) return unsupported(file, "its first directory is no full image");
  if (full.format.bits == 1) return unsupported(file, "samples of one bit");
  const Sample sample = tiff::decoded_sample(full.format);
  if (sample == Sample::I8) return unsupported(file, "signed bytes");
  if (sample == Sample::U64 || sample == Sample::I64) return unsupported(file, "integers of 64 bits");

  MapDescription map;
  map.path = file.source().name();
  map.format = "GTiff";
  map.layout = file.cloud_optimized() ? "COG" : "";
  map.compression = tiff::to_string(full.format.codec);
  if (full.format.codec == tiff::Codec::Jpeg && full.format.photometric == Photometric::YCbCr)
    map.compression = "YCbCr JPEG";
  if (full.format.lerc_packing) map.compression += full.format.lerc_packing == 1 ? "_DEFLATE" : "_ZSTD";

  // Levels, from the finest; those that do not belong are left out
  std::vector<Level> found;
  std::size_t masks = 0;
  for (const Directory& directory : directories) {
    masks += directory.mask;
    if (directory.mask) continue;
    if (!directory.reduced && &directory != &full) return unsupported(file, "several images");
    Level level{static_cast<std::int32_t>(directory.width), static_cast<std::int32_t>(directory.height)};
    level.texels_x = static_cast<double>(full.width) / directory.width;
    level.texels_y = static_cast<double>(full.height) / directory.height;
    level.tile_width = static_cast<std::int32_t>(directory.format.tile_width);
    level.tile_height = static_cast<std::int32_t>(directory.format.tile_height);
    const bool alike = directory.format.samples == full.format.samples &&
                       tiff::decoded_sample(directory.format) == tiff::decoded_sample(full.format);
    if (!found.empty() && !(alike && level_belongs(level, found.front())))
      map.warnings.push_back(fmt::format("overview {} of {} x {} does not belong to this raster and is not used",
                                         &directory - &full - 1, level.width, level.height));
    else
      found.push_back(level);
  }
  std::stable_sort(found.begin(), found.end(), [](const Level& a, const Level& b) { return a.width > b.width; });
  for (const Level& level : found)
    if (map.levels.empty() || level.width != map.levels.back().width || level.height != map.levels.back().height)
      map.levels.push_back(level);

  const auto metadata = read_metadata(file, full);
  if (!metadata) return fail(metadata);
  auto bands = describe_bands(file, *metadata);
  if (!bands) return fail(bands);
  map.bands = std::move(*bands);
  const bool alpha = std::any_of(map.bands.begin(), map.bands.end(), [](const Band& b) { return b.color == "Alpha"; });
  map.validity = masks > 0                  ? ValiditySource::Mask
                 : map.bands.front().nodata ? ValiditySource::Nodata
                 : alpha                    ? ValiditySource::Alpha
                                            : ValiditySource::None;

  auto place = describe_place(file);
  if (!place) return fail(place);
  map.georeference = std::move(*place);
  const auto first_of = [&](std::initializer_list<const char*> names, std::uint16_t tag) -> std::string {
    for (const char* name : names)
      if (const auto item = metadata->items.find(name); item != metadata->items.end() && !item->second.empty())
        return item->second;
    const Field* field = tag ? full.field(tag) : nullptr;
    return field ? file.text(*field).value_or("") : "";
  };
  map.acquired = first_of({"NADIR_ACQUIRED", "ACQUISITIONDATETIME"}, tiff::tag::date_time);
  map.attribution = first_of({"NADIR_ATTRIBUTION"}, tiff::tag::copyright);
  map.licence = first_of({"NADIR_LICENCE"}, 0);
  map.role = first_of({"NADIR_ROLE"}, 0);
  add_warnings(map);
  return map;
}

}  // namespace nadir::tile

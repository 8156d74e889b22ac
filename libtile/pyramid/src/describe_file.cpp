// What a map's file says of itself beyond its tiles. GDAL writes it into an empty file of the same kind, and its fields
// are taken over: keys of CRSs and the spelling of metadata are understood there.
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "design.h"
#include "nadir/base/byte_source.h"
#include "nadir/gdal/dataset.h"
#include "nadir/tiff/tiff_file.h"

namespace nadir::pyramid {
namespace {

/// A file in GDAL's memory, gone with this object.
class MemoryFile : public ByteSource {
 public:
  MemoryFile() {
    static std::atomic<unsigned> counter{0};
    path_ = fmt::format("/vsimem/nadir-fields-{}.tif", counter++);
  }
  ~MemoryFile() override { VSIUnlink(path_.c_str()); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::string& name() const override { return path_; }
  std::uint64_t size() const override {
    vsi_l_offset bytes = 0;
    VSIGetMemFileBuffer(path_.c_str(), &bytes, FALSE);
    return bytes;
  }
  Result<void> read(std::uint64_t offset, std::span<std::byte> out) const override {
    vsi_l_offset bytes = 0;
    const auto* begin = reinterpret_cast<const std::byte*>(VSIGetMemFileBuffer(path_.c_str(), &bytes, FALSE));
    if (offset > bytes || out.size() > bytes - offset) return fail(Error::Kind::Io, path_ + ": ends early");
    std::copy_n(begin + offset, out.size(), out.begin());
    return {};
  }

 private:
  std::string path_;
};

GDALDataType gdal_type(mosaic::Sample sample) {
  using mosaic::Sample;
  switch (sample) {
    case Sample::U16:
      return GDT_UInt16;
    case Sample::I16:
      return GDT_Int16;
    case Sample::U32:
      return GDT_UInt32;
    case Sample::I32:
      return GDT_Int32;
    case Sample::U64:
      return GDT_UInt64;
    case Sample::I64:
      return GDT_Int64;
    case Sample::F32:
      return GDT_Float32;
    case Sample::F64:
      return GDT_Float64;
    case Sample::U8:
    case Sample::I8:
      break;
  }
  return GDT_Byte;
}

gdal::Dataset create_template(const Design& design, const std::string& path) {
  const TexelType& type = design.mosaic.type();
  const tiff::Photometric photometric = design.codec.imagery.photometric;
  CPLStringList options;
  options.SetNameValue("TILED", "YES");
  options.SetNameValue("BLOCKXSIZE", "16");
  options.SetNameValue("BLOCKYSIZE", "16");
  options.SetNameValue("INTERLEAVE", "PIXEL");
  options.SetNameValue("PHOTOMETRIC", photometric == tiff::Photometric::Rgb       ? "RGB"
                                      : photometric == tiff::Photometric::Palette ? "PALETTE"
                                                                                  : "MINISBLACK");
  options.SetNameValue("ALPHA", type.alpha ? "NON-PREMULTIPLIED" : "NO");
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  return gdal::Dataset{driver->Create(path.c_str(), 1, 1, type.bands, gdal_type(type.sample), options.List())};
}

void set_nodata(GDALRasterBand& band, const TexelType& type) {
  if (!type.nodata) return;
  if (type.sample == mosaic::Sample::I64)
    band.SetNoDataValueAsInt64(static_cast<std::int64_t>(*type.nodata));
  else if (type.sample == mosaic::Sample::U64)
    band.SetNoDataValueAsUInt64(static_cast<std::uint64_t>(*type.nodata));
  else
    band.SetNoDataValue(*type.nodata);
}

GDALColorInterp color_of(const std::string& name) {
  for (int i = 0; i <= GCI_Max; ++i)
    if (name == GDALGetColorInterpretationName(static_cast<GDALColorInterp>(i))) return static_cast<GDALColorInterp>(i);
  return GCI_Undefined;
}

void set_band(GDALRasterBand& band, const mosaic::BandProperties& properties) {
  band.SetDescription(properties.name.c_str());
  if (const GDALColorInterp color = color_of(properties.color); color != GCI_Undefined)
    band.SetColorInterpretation(color);
  if (!properties.unit.empty()) band.SetUnitType(properties.unit.c_str());
  if (properties.scale != 1) band.SetScale(properties.scale);
  if (properties.offset != 0) band.SetOffset(properties.offset);
  for (const auto& [key, value] : properties.metadata) band.SetMetadataItem(key.c_str(), value.c_str());
}

void set_palette(GDALRasterBand& band, const std::vector<std::uint16_t>& palette) {
  GDALColorTable table;
  const std::size_t count = palette.size() / 3;
  for (std::size_t i = 0; i < count; ++i) {
    const auto part = [&](std::size_t color) { return static_cast<short>(palette[color * count + i] / 257); };
    const GDALColorEntry entry{part(0), part(1), part(2), 255};
    table.SetColorEntry(static_cast<int>(i), &entry);
  }
  band.SetColorTable(&table);
}

void set_statistics(GDALRasterBand& band, const BandStatistics& statistics, std::uint64_t texels) {
  if (statistics.count == 0) return;
  const auto set = [&](const char* key, double value) {
    band.SetMetadataItem(key, fmt::format("{:.15g}", value).c_str());
  };
  set("STATISTICS_MINIMUM", statistics.minimum);
  set("STATISTICS_MAXIMUM", statistics.maximum);
  set("STATISTICS_MEAN", statistics.mean);
  set("STATISTICS_STDDEV", std::sqrt(statistics.sum_of_squares / static_cast<double>(statistics.count)));
  band.SetMetadataItem(
      "STATISTICS_VALID_PERCENT",
      fmt::format("{:.4g}", 100 * static_cast<double>(statistics.count) / static_cast<double>(texels)).c_str());
}

/// Where the raster lies: on the mosaic's grid, or where the only source's control points say.
Result<void> set_place(GDALDataset& file, const mosaic::Mosaic& mosaic) {
  if (const auto& grid = mosaic.grid()) {
    OGRSpatialReference crs;
    crs.SetFromUserInput(grid->definition.c_str());
    crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    file.SetSpatialRef(&crs);
    const auto& m = grid->crs_from_texel.matrix();
    std::array<double, 6> transform = {m(0, 2), m(0, 0), m(0, 1), m(1, 2), m(1, 0), m(1, 1)};
    file.SetGeoTransform(transform.data());
    return {};
  }
  auto source = gdal::open_raster(mosaic.sources().rasters.front()->label());
  if (!source) return fail(source);
  file.SetGCPs((*source)->GetGCPCount(), (*source)->GetGCPs(), (*source)->GetGCPSpatialRef());
  return {};
}

/// Rational polynomial coefficients count texels of the raster that has them: they stay where all of it stays.
void keep_rational_coefficients(GDALDataset& file, const mosaic::Mosaic& mosaic) {
  const mosaic::Layer& layer = mosaic.layers().front();
  const auto shift = layer.placement ? layer.placement->shift() : std::optional<std::array<std::int64_t, 2>>{{0, 0}};
  if (mosaic.layers().size() != 1 || !shift || *shift != std::array<std::int64_t, 2>{0, 0} ||
      layer.source->width() != mosaic.width() || layer.source->height() != mosaic.height())
    return;
  const auto source = gdal::open_raster(layer.source->label());
  if (!source) return;  // a folder of tiles has no coefficients
  if (char** coefficients = (*source)->GetMetadata("RPC")) file.SetMetadata(coefficients, "RPC");
}

void set_metadata(GDALDataset& file, const Design& design, const BuildOptions& options) {
  for (const auto& [key, value] : design.mosaic.sources().metadata) file.SetMetadataItem(key.c_str(), value.c_str());
  const auto set = [&](const char* key, std::string_view value) {
    if (!value.empty()) file.SetMetadataItem(key, std::string(value).c_str());
  };
  if (design.role) set("NADIR_ROLE", to_string(*design.role));
  set("NADIR_ACQUIRED", options.acquired);
  set("NADIR_ATTRIBUTION", options.attribution);
  set("NADIR_LICENCE", options.licence);
  set("NADIR_REDUCTION", describe(design.reduction));
  if (options.compression == Compression::Lerc) set("NADIR_MAX_ERROR", fmt::format("{}", options.max_error));
  if (design.mosaic.sources().pixel_is_point) set("AREA_OR_POINT", "Point");
}

Result<void> write_template(const Design& design, const BuildOptions& options,
                            const std::vector<BandStatistics>* statistics, const std::string& path) {
  const gdal::GdalMessages messages;
  gdal::Dataset file = create_template(design, path);
  if (!file)
    return fail(Error::Kind::Io,
                fmt::format("{}: its headers cannot be made: {}", options.output.string(), messages.last()));
  set_metadata(*file, design, options);
  keep_rational_coefficients(*file, design.mosaic);
  if (const auto ok = set_place(*file, design.mosaic); !ok) return ok;
  const TexelType& type = design.mosaic.type();
  const auto& sources = design.mosaic.sources();
  if (!sources.palette.empty()) set_palette(*file->GetRasterBand(1), sources.palette);
  const std::uint64_t texels =
      static_cast<std::uint64_t>(design.mosaic.width()) * static_cast<std::uint64_t>(design.mosaic.height());
  for (int b = 1; b <= type.bands; ++b) {
    GDALRasterBand& band = *file->GetRasterBand(b);
    set_band(band, sources.bands[static_cast<std::size_t>(b) - 1]);
    set_nodata(band, type);
    if (statistics && b <= type.data_bands())
      set_statistics(band, (*statistics)[static_cast<std::size_t>(b) - 1], texels);
  }
  return {};
}

/// Bytes of a value of each TIFF type, by number.
constexpr std::array<std::uint64_t, 19> value_bytes = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4, 0, 0, 8, 8, 8};

/// Fields that say how tiles are stored, which is ours to say.
bool is_structure(std::uint16_t tag) {
  static constexpr std::array<std::uint16_t, 18> tags = {254, 256, 257, 258, 259, 262, 273, 277, 278,
                                                         279, 284, 317, 322, 323, 324, 325, 338, 339};
  return std::find(tags.begin(), tags.end(), tag) != tags.end();
}

}  // namespace

Result<tiff::CogImage> describe_file(const Design& design, const BuildOptions& options, const TilePacker& packer,
                                     const std::vector<LevelSize>& levels,
                                     const std::vector<BandStatistics>* statistics) {
  const auto memory = std::make_shared<const MemoryFile>();
  if (const auto ok = write_template(design, options, statistics, memory->name()); !ok) return fail(ok);
  const auto file = tiff::TiffFile::open(memory);
  if (!file) return fail(file);

  tiff::CogImage image;
  image.format = packer.imagery_format();
  image.extra_samples = design.codec.extra_samples;
  if (const tiff::TileFormat* mask = packer.mask_format()) image.mask = *mask;
  for (const LevelSize& size : levels)
    image.levels.push_back({static_cast<std::uint32_t>(size.width), static_cast<std::uint32_t>(size.height)});
  for (const tiff::Field& field : (*file)->directories().front().fields) {
    if (is_structure(field.tag) || field.type >= value_bytes.size()) continue;
    tiff::NewField copy{field.tag, field.type, field.count, {}};
    copy.values.resize(field.count * value_bytes[field.type]);
    if (const auto ok = memory->read(field.place, copy.values); !ok) return fail(ok);
    const bool shared = field.tag == tiff::tag::gdal_nodata || field.tag == tiff::tag::color_map;
    (shared ? image.shared_fields : image.fields).push_back(std::move(copy));
  }
  return image;
}

}  // namespace nadir::pyramid

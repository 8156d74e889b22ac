#include "nadir/tile/map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>
#include <string_view>

#include "describe.h"
#include "gdal_dataset.h"
#include "nadir/base/text.h"

namespace nadir::tile {
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

/// The value that samples of type T are compared with; empty where none can equal it.
template <class T>
std::optional<T> nodata_as(const std::optional<double>& nodata) {
  if (!nodata || std::isnan(*nodata)) return std::nullopt;
  if constexpr (std::is_floating_point_v<T>) {
    constexpr double largest = std::numeric_limits<T>::max();
    return static_cast<T>(std::clamp(*nodata, -largest, largest));  // some writers note a double just beyond the type
  } else {
    if (*nodata != std::floor(*nodata) || *nodata < std::numeric_limits<T>::min() ||
        *nodata > std::numeric_limits<T>::max())
      return std::nullopt;
    return static_cast<T>(*nodata);
  }
}

/// Clears the validity of texels whose samples all equal nodata, or of which one is not finite.
template <class T>
void check_samples(const T* samples, int bands, const std::vector<std::optional<T>>& nodata,
                   std::vector<std::uint8_t>& valid) {
  const bool every_band_has_nodata =
      std::all_of(nodata.begin(), nodata.end(), [](const auto& n) { return n.has_value(); });
  if (!every_band_has_nodata && !std::is_floating_point_v<T>) return;
  for (std::size_t i = 0; i < valid.size(); ++i) {
    const T* texel = samples + i * static_cast<std::size_t>(bands);
    bool all_nodata = every_band_has_nodata, finite = true;
    for (int b = 0; b < bands; ++b) {
      all_nodata = all_nodata && texel[b] == *nodata[static_cast<std::size_t>(b)];
      if constexpr (std::is_floating_point_v<T>) finite = finite && std::isfinite(texel[b]);
    }
    if (all_nodata || !finite) valid[i] = 0;
  }
}

}  // namespace

struct Map::Shared {
  Shared(MapDescription d, geodesy::Projection p, std::string path, Dataset first)
      : description(std::move(d)), projection(std::move(p)), pool(std::move(path), std::move(first)) {}

  MapDescription description;
  geodesy::Projection projection;
  std::vector<int> overview_of_level;  // from level 1 on
  Eigen::Affine2d crs_from_texel, texel_from_crs;
  geodesy::Geodetic center;
  Eigen::Vector2d texel_size_m;
  DatasetPool pool;
  std::atomic<std::int64_t> windows_read{0}, samples_read{0};

  GDALRasterBand& band(GDALDataset& dataset, int level, int number) const {
    GDALRasterBand* full = dataset.GetRasterBand(number);
    return level == 0 ? *full : *full->GetOverview(overview_of_level[static_cast<std::size_t>(level) - 1]);
  }
};

Result<Map> Map::open(const std::string& path) {
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

  auto projection = geodesy::Projection::from_definition(description.georeference->wkt);
  if (!projection) return fail(projection.error().kind, fmt::format("{}: {}", path, projection.error().message));

  const Eigen::Affine2d crs_from_texel = description.georeference->crs_from_texel;
  const Eigen::Vector2d middle(description.levels[0].width * 0.5, description.levels[0].height * 0.5);
  projection->wrap_around((crs_from_texel * middle).x());

  // The centre, and half a texel from it to each side, on the ground.
  std::array<Eigen::Vector2d, 5> points = {middle, middle + Eigen::Vector2d(-0.5, 0), middle + Eigen::Vector2d(0.5, 0),
                                           middle + Eigen::Vector2d(0, -0.5), middle + Eigen::Vector2d(0, 0.5)};
  for (auto& p : points) p = crs_from_texel * p;
  projection->lon_lat_from_crs(points);
  std::array<Eigen::Vector3d, 5> ecef;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite())
      return fail(
          Error::Kind::Malformed,
          fmt::format("{}: its middle lies where its CRS {} is not defined: is the geotransform in that CRS's units?",
                      path, description.georeference->crs));
    ecef[i] = geodesy::ecef_from_geodetic({points[i].y(), points[i].x(), 0}).xyz;
  }

  auto shared = std::make_shared<Shared>(std::move(description), std::move(*projection), path, std::move(*dataset));
  shared->overview_of_level = std::move(overview_of_level);
  shared->crs_from_texel = crs_from_texel;
  shared->texel_from_crs = crs_from_texel.inverse();
  shared->center = {points[0].y(), points[0].x(), 0};
  shared->texel_size_m = {(ecef[2] - ecef[1]).norm(), (ecef[4] - ecef[3]).norm()};
  return Map(std::move(shared));
}

const MapDescription& Map::description() const { return shared_->description; }
const geodesy::Projection& Map::projection() const { return shared_->projection; }
const Eigen::Affine2d& Map::crs_from_texel() const { return shared_->crs_from_texel; }
const Eigen::Affine2d& Map::texel_from_crs() const { return shared_->texel_from_crs; }
const geodesy::Geodetic& Map::center() const { return shared_->center; }
const Eigen::Vector2d& Map::texel_size_m() const { return shared_->texel_size_m; }
MapCounters Map::counters() const { return {shared_->windows_read, shared_->samples_read}; }

Result<SampleType> Map::sample_type(std::span<const int> bands) const {
  if (bands.empty()) return fail(Error::Kind::Malformed, fmt::format("{}: no band asked for", description().path));
  std::optional<SampleType> common;
  for (const int number : bands) {
    if (number < 1 || number > static_cast<int>(description().bands.size()))
      return fail(Error::Kind::NotFound, fmt::format("{}: no band {}: it has bands 1 to {}", description().path, number,
                                                     description().bands.size()));
    const Band& band = description().bands[static_cast<std::size_t>(number) - 1];
    if (!band.sample_type)
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: band {} {}", description().path, number, band.why_not_rendered()));
    common = !common || *common == *band.sample_type ? *band.sample_type : SampleType::Float32;
  }
  return *common;
}

Result<Texels> Map::read(int level, const Window& window, std::span<const int> bands) const {
  const auto type = sample_type(bands);
  if (!type) return fail(type);
  assert(level >= 0 && level < static_cast<int>(levels().size()));
  assert(window.width > 0 && window.height > 0);
  auto dataset = shared_->pool.borrow();
  if (!dataset) return fail(dataset);

  Texels texels{*type, static_cast<int>(bands.size()), window, {}, {}};
  const std::size_t area = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
  const std::size_t sample = size_bytes(*type), texel = sample * bands.size();
  texels.samples.resize(area * texel);

  GdalMessages messages;
  CPLErr status = CE_None;
  for (std::size_t b = 0; b < bands.size() && status == CE_None; ++b) {
    status = shared_->band(**dataset, level, bands[b])
                 .RasterIO(GF_Read, window.x, window.y, window.width, window.height, texels.samples.data() + b * sample,
                           window.width, window.height, gdal_type(*type), static_cast<GSpacing>(texel),
                           static_cast<GSpacing>(texel * static_cast<std::size_t>(window.width)), nullptr);
  }
  std::vector<std::uint8_t> valid(area, 1);
  const bool masked = description().validity == ValiditySource::Mask || description().validity == ValiditySource::Alpha;
  std::vector<std::uint8_t> mask(masked ? area : 0);
  for (std::size_t b = 0; b < bands.size() && status == CE_None && masked; ++b) {
    GDALRasterBand& band = shared_->band(**dataset, level, bands[b]);
    status = band.GetMaskBand()->RasterIO(GF_Read, window.x, window.y, window.width, window.height, mask.data(),
                                          window.width, window.height, GDT_Byte, 0, 0, nullptr);
    for (std::size_t i = 0; i < area; ++i) valid[i] = valid[i] && mask[i] >= 128;
    if (band.GetMaskFlags() & GMF_PER_DATASET) break;  // the same one for all bands
  }
  shared_->pool.give_back(std::move(*dataset));
  if (status != CE_None || messages.failed())
    return fail(Error::Kind::Io,
                fmt::format("{}: level {}, texels {} to {} by {} to {} cannot be read: {}; if the file is damaged, "
                            "fetch or build it again",
                            description().path, level, window.x, window.x + window.width, window.y,
                            window.y + window.height, without_path(messages.first(), description().path)));

  with_sample_type(*type, [&]<class T>(T) {
    std::vector<std::optional<T>> nodata;
    for (const int number : bands)
      nodata.push_back(nodata_as<T>(description().bands[static_cast<std::size_t>(number) - 1].nodata));
    T* samples = reinterpret_cast<T*>(texels.samples.data());
    check_samples(samples, texels.bands, nodata, valid);
    // What is invalid takes part in no average; zero instead of NaN keeps it from spreading through a product with
    // zero.
    for (std::size_t i = 0; i < area; ++i)
      if (!valid[i]) std::fill_n(samples + i * bands.size(), bands.size(), T{});
  });
  if (std::find(valid.begin(), valid.end(), 0) != valid.end()) texels.validity = std::move(valid);
  shared_->windows_read.fetch_add(1, std::memory_order_relaxed);
  shared_->samples_read.fetch_add(static_cast<std::int64_t>(area * bands.size()), std::memory_order_relaxed);
  return texels;
}

}  // namespace nadir::tile

#include "nadir/tile/map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>

#include "nadir/tile/raster.h"
#include "nadir/transfer/remote_file.h"
#include "tiff_raster.h"
#include "tiff_tiles.h"
#include "validity.h"

namespace nadir::tile {

struct Map::Shared {
  Shared(std::unique_ptr<Raster> r, geodesy::Projection p) : raster(std::move(r)), projection(std::move(p)) {}

  const std::unique_ptr<Raster> raster;
  geodesy::Projection projection;
  Eigen::Affine2d crs_from_texel, texel_from_crs;
  geodesy::Geodetic center;
  Eigen::Vector2d texel_size_m;
  bool goes_around = false;
  std::atomic<std::int64_t> windows_read{0}, samples_read{0};
};

namespace {

/// Where GDAL finds what our own transfers read.
std::string gdal_name_of(const std::string& url) {
  return url.starts_with("s3://") ? "/vsis3/" + url.substr(5) : "/vsicurl/" + url;
}

Result<std::unique_ptr<Raster>> open_by_gdal(const std::string& path) {
  const auto module = raster_module();
  if (!module) return fail(module.error().kind, fmt::format("{}: {}", path, module.error().message));
  return (*module)->open(path);
}

Result<std::unique_ptr<Raster>> open_raster(const std::string& path) {
  if (transfer::is_url(path)) {
    auto file = transfer::open_remote(path);
    if (!file) return fail(file);
    auto raster = open_tiff_raster(std::move(*file), gdal_name_of(path));
    if (raster || raster.error().kind != Error::Kind::Unsupported) return raster;
    return open_by_gdal(gdal_name_of(path));
  }
  if (auto file = LocalFile::open(path, IfWritten::Fail))
    if (auto raster = open_tiff_raster(std::move(*file), path)) return raster;
  // All others, and those whose fault GDAL knows best how to tell
  return open_by_gdal(path);
}

bool spans_a_turn(const geodesy::Projection& projection, const Eigen::Affine2d& crs_from_texel, std::int32_t width) {
  const auto turn = projection.turn();
  const auto& m = crs_from_texel.linear();
  return turn && m(0, 1) == 0 && m(1, 0) == 0 && std::abs(*turn / std::abs(m(0, 0)) - width) <= 0.01;
}

}  // namespace

Result<Map> Map::open(const std::string& path) {
  auto raster = open_raster(path);
  if (!raster) return fail(raster);
  return over(std::move(*raster));
}

Result<Map> Map::open(std::shared_ptr<const ByteSource> source) {
  auto raster = open_tiff_raster(std::move(source), "");
  if (!raster) return fail(raster);
  return over(std::move(*raster));
}

Result<Map> Map::over(std::unique_ptr<Raster> raster) {
  const MapDescription& description = raster->description();
  const std::string& path = description.path;
  auto projection = geodesy::Projection::from_definition(description.georeference->definition);
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
          fmt::format("{}: its middle ({:.8g}, {:.8g}) lies where its CRS {} is not defined: make sure that its "
                      "geotransform is in that CRS's units, or warp it to a CRS for its place with gdalwarp -t_srs",
                      path, (crs_from_texel * middle).x(), (crs_from_texel * middle).y(),
                      description.georeference->crs));
    ecef[i] = geodesy::ecef_from_geodetic({points[i].y(), points[i].x(), 0}).xyz;
  }

  auto shared = std::make_shared<Shared>(std::move(raster), std::move(*projection));
  shared->crs_from_texel = crs_from_texel;
  shared->texel_from_crs = crs_from_texel.inverse();
  shared->center = {points[0].y(), points[0].x(), 0};
  shared->goes_around = spans_a_turn(shared->projection, crs_from_texel, description.levels[0].width);
  shared->texel_size_m = {(ecef[2] - ecef[1]).norm(), (ecef[4] - ecef[3]).norm()};
  return Map(std::move(shared));
}

const MapDescription& Map::description() const { return shared_->raster->description(); }
const geodesy::Projection& Map::projection() const { return shared_->projection; }
const Eigen::Affine2d& Map::crs_from_texel() const { return shared_->crs_from_texel; }
const Eigen::Affine2d& Map::texel_from_crs() const { return shared_->texel_from_crs; }
const geodesy::Geodetic& Map::center() const { return shared_->center; }
const Eigen::Vector2d& Map::texel_size_m() const { return shared_->texel_size_m; }
bool Map::goes_around() const { return shared_->goes_around; }
MapCounters Map::counters() const { return {shared_->windows_read, shared_->samples_read}; }
const TiffTiles* Map::tiles() const { return shared_->raster->tiles(); }

std::optional<double> Map::loss(int level, const Window& window, std::span<const int> bands) const {
  return tiles() ? tiles()->loss(level, window, bands) : std::nullopt;
}

void Map::count_read(std::int64_t texels, std::size_t bands) const {
  shared_->windows_read.fetch_add(1, std::memory_order_relaxed);
  shared_->samples_read.fetch_add(texels * static_cast<std::int64_t>(bands), std::memory_order_relaxed);
}

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
  auto texels = shared_->raster->read(level, window, bands, *type);
  if (!texels) return fail(texels);

  const auto area = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
  const NodataRule nodata(description(), bands, *type);
  std::vector<std::uint8_t>& valid = texels->validity;
  if (valid.empty() && !nodata.never()) valid.assign(area, 1);
  nodata.check(texels->samples.data(), area, valid.data());
  // What is invalid takes part in no average; zero instead of NaN keeps it from spreading through a product with zero.
  const std::size_t texel_bytes = bands.size() * size_bytes(*type);
  bool all_valid = true;
  for (std::size_t i = 0; i < valid.size(); ++i) {
    if (valid[i]) continue;
    std::fill_n(texels->samples.begin() + static_cast<std::ptrdiff_t>(i * texel_bytes), texel_bytes, std::byte{0});
    all_valid = false;
  }
  if (all_valid) valid.clear();
  count_read(static_cast<std::int64_t>(area), bands.size());
  return texels;
}

Result<MapDescription> describe(const std::string& path) {
  if (auto raster = open_raster(path)) return (*raster)->description();
  const auto module = raster_module();
  if (!module) return fail(module.error().kind, fmt::format("{}: {}", path, module.error().message));
  return (*module)->describe(path);
}

}  // namespace nadir::tile

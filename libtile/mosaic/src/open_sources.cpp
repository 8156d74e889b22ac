#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>

#include "agreement.h"
#include "nadir/gdal/raster.h"
#include "nadir/mosaic/source.h"
#include "overlap.h"
#include "readers.h"
#include "source_list.h"
#include "twin_headers.h"

namespace nadir::mosaic {
namespace {

/// Of GDAL's own cache: what it decodes is kept in ours, converted.
constexpr std::uint64_t gdal_cache_bytes = 32 << 20;

/// The headers of all, or the error of the first that has one.
Result<std::vector<RasterHeader>> read_headers(const std::vector<NamedRaster>& rasters) {
  std::vector<std::optional<Result<RasterHeader>>> found(rasters.size());
  TwinHeaders twins;
  std::atomic<std::size_t> next{0};
  const auto read_some = [&] {
    for (std::size_t i = next++; i < rasters.size(); i = next++) found[i] = twins.read(rasters[i]);
  };
  std::vector<std::thread> helpers;
  const std::size_t most_helpers = std::max(1u, std::thread::hardware_concurrency()) - 1;
  while (helpers.size() < std::min(most_helpers, rasters.size() - 1)) helpers.emplace_back(read_some);
  read_some();
  for (std::thread& helper : helpers) helper.join();
  std::vector<RasterHeader> headers;
  for (auto& header : found) {
    if (!*header) return fail(*header);
    headers.push_back(std::move(**header));
  }
  return headers;
}

std::shared_ptr<const Source> make_source(const RasterHeader& header, const Reading& reading,
                                          const std::shared_ptr<Shared>& shared) {
  constexpr std::uint64_t most_tile_bytes = 256 << 20;
  if (is_plain(header, reading)) return make_plain_source(header, reading, shared);
  if (header.tiff && header.tiff->image_directory.format.tile_bytes() <= most_tile_bytes)
    return make_tiled_source(header, reading, shared);
  return make_gdal_source(header, reading, shared);
}

}  // namespace

Result<Sources> open_sources(const SourceOptions& options) {
  const auto rasters = list_sources(options);
  if (!rasters) return fail(rasters);
  const auto headers = read_headers(*rasters);
  if (!headers) return fail(headers);
  auto agreement = agree(*headers, options);
  if (!agreement) return fail(agreement);

  gdal::limit_block_cache(gdal_cache_bytes);
  Sources sources = std::move(agreement->map);
  const auto shared = std::make_shared<Shared>(options.cache_bytes);
  for (const std::size_t i : stack(*headers, options.overlap, sources.warnings))
    sources.rasters.push_back(make_source((*headers)[i], agreement->readings[i], shared));
  return sources;
}

}  // namespace nadir::mosaic

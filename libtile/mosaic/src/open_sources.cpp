#include <tbb/parallel_for.h>

#include <algorithm>
#include <optional>

#include "agreement.h"
#include "nadir/gdal/raster.h"
#include "nadir/mosaic/source.h"
#include "overlap.h"
#include "readers.h"
#include "source_list.h"

namespace nadir::mosaic {
namespace {

/// Of GDAL's own cache: what it decodes is kept in ours, converted.
constexpr std::uint64_t gdal_cache_bytes = 32 << 20;

/// The headers of all, or the error of the first that has one.
Result<std::vector<RasterHeader>> read_headers(const std::vector<NamedRaster>& rasters) {
  std::vector<std::optional<Result<RasterHeader>>> found(rasters.size());
  tbb::parallel_for(std::size_t{0}, rasters.size(), [&](std::size_t i) { found[i] = read_header(rasters[i]); });
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

#pragma once

#include <memory>

#include "block_cache.h"
#include "conversion.h"
#include "nadir/mosaic/source.h"
#include "open_files.h"
#include "raster_header.h"

namespace nadir::mosaic {

/// What the sources of a map share.
struct Shared {
  explicit Shared(std::uint64_t cache_bytes) : blocks(cache_bytes) {}
  BlockCache blocks;
  OpenTiffs tiffs{128};
  OpenDatasets datasets{32};
};

/// Bands of a raster that the map takes, by number from 0, and in what the rows are that hold only these.
struct Reading {
  std::vector<int> bands;
  ConversionRule rule;  // its channels count among `bands`
};

/// Whether any window can be read without decoding or converting.
bool is_plain(const RasterHeader& header, const Reading& reading);

// Each reads one raster: `plain` of is_plain() ones straight into the rows wanted, `tiled` of all that have a
// TiffLayout, `gdal` of all others.
std::shared_ptr<const Source> make_plain_source(const RasterHeader& header, const Reading& reading,
                                                std::shared_ptr<Shared> shared);
std::shared_ptr<const Source> make_tiled_source(const RasterHeader& header, const Reading& reading,
                                                std::shared_ptr<Shared> shared);
std::shared_ptr<const Source> make_gdal_source(const RasterHeader& header, const Reading& reading,
                                               std::shared_ptr<Shared> shared);

}  // namespace nadir::mosaic

#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nadir/mosaic/source.h"
#include "raster_header.h"

namespace nadir::mosaic {

/// A band that a raster can give.
struct Candidate {
  Channel channel;
  std::string name, color;
};

/// The bands of a raster that a map takes.
struct Bands {
  std::vector<Candidate> data;
  std::optional<Channel> alpha;
};

/// What each raster gives: chosen by `options`, palettes expanded unless `keep_palettes`.
/// Errors name the raster, what was wanted and what it has.
Result<std::vector<Bands>> choose_bands(std::span<const RasterHeader> headers, const SourceOptions& options,
                                        bool& keep_palettes);

/// Lays the bands of all beside those of one of them, its index: the first, or the first with colours where others are
/// grey. Afterwards all have as many. Warnings tell what is left out.
Result<std::size_t> match_bands(std::span<const RasterHeader> headers, std::vector<Bands>& bands,
                                std::vector<std::string>& warnings);

}  // namespace nadir::mosaic

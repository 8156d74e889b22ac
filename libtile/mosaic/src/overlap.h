#pragma once

#include <span>
#include <string>
#include <vector>

#include "nadir/mosaic/source.h"
#include "raster_header.h"

namespace nadir::mosaic {

/// Seconds since 1970 in UTC of what metadata call a date and time: "2024:05:17 10:20:30", "2024-05-17T10:20:30.5Z",
/// "20240517", "2024-05-17T10:20:30+02:00". Without a zone it is taken as UTC. Empty where it is none.
std::optional<double> parse_time(std::string_view text);

/// The order in which rasters, by index, lie on one another, bottom first.
std::vector<std::size_t> stack(std::span<const RasterHeader> headers, Overlap overlap,
                               std::vector<std::string>& warnings);

}  // namespace nadir::mosaic

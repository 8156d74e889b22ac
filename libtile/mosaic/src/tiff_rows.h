#pragma once

#include <vector>

#include "nadir/tiff/decode.h"
#include "readers.h"

namespace nadir::mosaic {

/// Rows of a TIFF's bands as a conversion takes them.
struct TiffRows {
  ConversionRule rule;
  std::vector<std::uint32_t> planes;  // to be read: bands where they are stored apart, else 0
  std::vector<std::byte> missing;     // a texel of such a row where nothing was written: nodata or 0, alpha 0
};

TiffRows rows_of(const RasterHeader& header, const Reading& reading);

}  // namespace nadir::mosaic

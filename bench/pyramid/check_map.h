#pragma once

#include <cstdint>
#include <string>

#include "nadir/base/result.h"

namespace nadir::bench {

struct MapCheck {
  std::uint64_t bytes = 0;  // of the file
  double rms = 0;           // difference of level 0 from the source, levels of 255, over windows spread over it
  int levels = 0;
};

/// Looks whether `map` is what a builder had to make of the raster `source`: it opens, has its size and bands, levels
/// that halve (rounded either way) down to one tile of 512, and level 0 with the source's texels: the same where
/// `lossless`, else near them. An Error says what is wrong.
Result<MapCheck> check_map(const std::string& map, const std::string& source, bool lossless);

}  // namespace nadir::bench

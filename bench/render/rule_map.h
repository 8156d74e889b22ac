#pragma once

#include <string>

#include "nadir/tile/map.h"

namespace nadir::bench {

/// The name of a map by rule, of any side: its texels are computed where they are read.
std::string rule_map_name(std::int64_t side, double texel_m);

/// A map's file, or the map of such a name.
Result<tile::Map> open_file_or_rule(const std::string& name);

}  // namespace nadir::bench

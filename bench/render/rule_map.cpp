#include "rule_map.h"

#include <fmt/format.h>

#include "nadir/bench/procedural_tiff.h"

namespace nadir::bench {

std::string rule_map_name(std::int64_t side, double texel_m) { return fmt::format("rule:{}:{}", side, texel_m); }

Result<tile::Map> open_file_or_rule(const std::string& name) {
  if (!name.starts_with("rule:")) return tile::Map::open(name);
  MapRule rule;
  rule.width = rule.height = std::stoll(name.substr(5));
  rule.texel = std::stod(name.substr(name.rfind(':') + 1));
  rule.tile_size = 128;  // the map keeps 256 of them, which count as memory: 13 MB
  rule.west = 500'000 - rule.texel * static_cast<double>(rule.width) / 2;
  rule.north = 5'400'000 + rule.texel * static_cast<double>(rule.height) / 2;
  const auto tiff = ProceduralTiff::make(name, rule);
  if (!tiff) return fail(tiff);
  return tile::Map::open(*tiff);
}

}  // namespace nadir::bench

#include "nadir/tile/map_description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nadir/base/text.h"
#include "nadir/tile/raster.h"

namespace nadir::tile {

bool level_belongs(const Level& level, const Level& full) {
  // A size rounded by up to a texel moves the ratio by at most 1 / size.
  const double aspect = level.texels_x / level.texels_y;
  const double rounding = 1.0 / std::min(level.width, level.height);
  return level.width <= full.width && level.height <= full.height && std::abs(aspect - 1) <= 2 * rounding;
}

void add_warnings(MapDescription& map) {
  const Level& full = map.levels.front();
  const Level& coarsest = map.levels.back();
  if (std::max(coarsest.width, coarsest.height) > 1024)
    map.warnings.push_back(fmt::format(
        "its coarsest level has {} x {} texels: frames that see much of it read much of it; `nadir build` adds levels",
        coarsest.width, coarsest.height));
  if (full.tile_width == full.width && full.width > 2048)
    map.warnings.push_back("stored in rows, not in tiles: a small view reads whole rows; `nadir build` makes tiles");
  for (std::size_t i = 0; i < map.bands.size(); ++i) {
    const Band& band = map.bands[i];
    const std::string label = fmt::format("band {}", i + 1);
    if (!band.sample_type)
      map.warnings.push_back(fmt::format("{} {}", label, band.why_not_rendered()));
    else if (*band.sample_type == SampleType::Float32 && band.stored_type != "Float32")
      map.warnings.push_back(
          fmt::format("{} of type {} is read as float32, exact to 24 bits", label, band.stored_type));
    if (band.color == "Palette")
      map.warnings.push_back(fmt::format(
          "{} holds palette indices: render it with role labels, or expand it with gdal_translate -expand rgb", label));
    if (band.scale != 1 || band.offset != 0)
      map.warnings.push_back(
          fmt::format("{} has scale {} and offset {}: frames hold stored values", label, band.scale, band.offset));
    const bool integral = band.sample_type && *band.sample_type != SampleType::Float32;
    if (integral && band.nodata && *band.nodata != std::floor(*band.nodata))
      map.warnings.push_back(
          fmt::format("{} of type {} can never hold its nodata value {}", label, band.stored_type, *band.nodata));
  }
  if (!map.georeference) map.warnings.push_back("cannot be rendered: " + map.georeference_problem);
}

std::vector<int> MapDescription::data_bands() const {
  std::vector<int> numbers;
  for (std::size_t i = 0; i < bands.size(); ++i)
    if (bands[i].color != "Alpha") numbers.push_back(static_cast<int>(i) + 1);
  return numbers;
}

std::string Band::why_not_rendered() const {
  const bool is_signed_byte = stored_type == "Int8";
  return fmt::format(
      "has type {}, which is not rendered; make a map of {} first, for instance with gdal_calc.py --calc {}",
      stored_type, is_signed_byte ? "16-bit samples" : "the magnitudes",
      is_signed_byte ? "'A.astype(int8).astype(int16)' --type Int16" : "'abs(A)' --type Float32");
}

Result<int> MapDescription::find_band(const std::string& name) const {
  std::vector<std::string_view> known;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    if (bands[i].name == name && !name.empty()) return static_cast<int>(i) + 1;
    if (!bands[i].name.empty()) known.push_back(bands[i].name);
  }
  const auto number = parse_number(name);
  if (number && *number == std::floor(*number) && *number >= 1 && *number <= static_cast<double>(bands.size()))
    return static_cast<int>(*number);
  return fail(Error::Kind::NotFound, fmt::format("{}: no band '{}': it has bands 1 to {}{}", path, name, bands.size(),
                                                 known.empty() ? "" : suggestion(name, known)));
}

}  // namespace nadir::tile

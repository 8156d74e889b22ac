#include "nadir/tile/role.h"

#include <array>

#include "nadir/base/text.h"

namespace nadir::tile {
namespace {
constexpr std::array<std::string_view, 6> roles = {"optical", "radar", "infrared", "elevation", "labels", "field"};
constexpr std::array<std::string_view, 2> radar_scales = {"decibel", "linear"};
}  // namespace

std::string_view to_string(Role role) { return roles[static_cast<std::size_t>(role)]; }
std::string_view to_string(RadarScale scale) { return radar_scales[static_cast<std::size_t>(scale)]; }
Result<Role> parse_role(std::string_view name) { return parse_name<Role>("role", name, roles); }
Result<RadarScale> parse_radar_scale(std::string_view name) {
  return parse_name<RadarScale>("radar scale", name, radar_scales);
}

}  // namespace nadir::tile

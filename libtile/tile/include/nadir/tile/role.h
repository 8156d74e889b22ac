#pragma once

#include <string_view>

#include "nadir/base/result.h"

namespace nadir::tile {

/// What a map's samples mean, which decides how they may be averaged: labels never, radar in dB as power.
enum class Role { Optical, Radar, Infrared, Elevation, Labels, Field };
std::string_view to_string(Role role);  // "optical"
Result<Role> parse_role(std::string_view name);

/// How radar samples relate to power: ten times its decimal logarithm, or as they are.
enum class RadarScale { Decibel, Linear };
std::string_view to_string(RadarScale scale);  // "decibel"
Result<RadarScale> parse_radar_scale(std::string_view name);

/// What a radar map that does not say is taken for: archives deliver dB as floats, amplitudes as integers.
constexpr RadarScale usual_radar_scale(bool floating_point) {
  return floating_point ? RadarScale::Decibel : RadarScale::Linear;
}

}  // namespace nadir::tile

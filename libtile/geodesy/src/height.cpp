#include "nadir/geodesy/height.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "nadir/base/text.h"
#include "nadir/geodesy/crs_module.h"

namespace nadir::geodesy {
namespace {

constexpr std::array<std::string_view, 3> datum_names = {"ellipsoid", "msl", "agl"};

}  // namespace

std::string_view to_string(HeightDatum datum) { return datum_names[static_cast<std::size_t>(datum)]; }

Result<TypedHeight> parse_height(std::string_view text) {
  const std::string_view whole = trim(text);
  const std::size_t end = whole.find_first_of(" \t");
  const auto value = parse_number(whole.substr(0, end));
  if (!value)
    return fail(
        Error::Kind::Malformed,
        fmt::format("height '{}': expected metres with an optional datum, such as '120', '120 msl' or '120 agl'",
                    whole));
  if (end == std::string_view::npos) return TypedHeight{*value, HeightDatum::Ellipsoid};
  const std::string_view word = trim(whole.substr(end));
  for (std::size_t i = 0; i < datum_names.size(); ++i)
    if (word == datum_names[i]) return TypedHeight{*value, static_cast<HeightDatum>(i)};
  return fail(Error::Kind::Malformed,
              fmt::format("height '{}': unknown datum '{}'{}", whole, word, suggestion(word, datum_names)));
}

Result<double> geoid_height_m(double lat_rad, double lon_rad) {
  const auto module = crs_module();
  if (!module) return fail(module);
  return (*module)->geoid_height_m(lat_rad, lon_rad);
}

Result<double> ellipsoidal_height_m(const TypedHeight& height, double lat_rad, double lon_rad, double ground_m) {
  switch (height.datum) {
    case HeightDatum::Ellipsoid:
      return height.value_m;
    case HeightDatum::Agl:
      return height.value_m + ground_m;
    case HeightDatum::Msl:
      break;
  }
  const auto geoid_m = geoid_height_m(lat_rad, lon_rad);
  if (!geoid_m) return geoid_m;
  return height.value_m + *geoid_m;
}

}  // namespace nadir::geodesy

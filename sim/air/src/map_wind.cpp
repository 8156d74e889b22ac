#include "nadir/sim/map_wind.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "nadir/base/text.h"
#include "nadir/geodesy/geodetic.h"
#include "nadir/tile/role.h"

namespace nadir::sim {
namespace {
using Eigen::Vector2d, Eigen::Vector3d;

constexpr std::int32_t block_side = 64;
constexpr std::array<std::string_view, 2> outside_names = {"edge", "calm"};

/// East and north as stored; empty where there is no data.
std::optional<Vector2d> sample(const tile::Texels& texels, std::int32_t col, std::int32_t row) {
  const std::size_t i =
      static_cast<std::size_t>(row - texels.window.y) * static_cast<std::size_t>(texels.window.width) +
      static_cast<std::size_t>(col - texels.window.x);
  if (!texels.validity.empty() && !texels.validity[i]) return std::nullopt;
  return tile::with_sample_type(texels.type, [&]<class T>(T) {
    std::array<T, 2> two;
    std::memcpy(two.data(), texels.samples.data() + 2 * i * sizeof(T), sizeof two);
    return Vector2d(static_cast<double>(two[0]), static_cast<double>(two[1]));
  });
}

}  // namespace

std::string_view to_string(MapWind::Outside outside) { return outside_names[static_cast<std::size_t>(outside)]; }
Result<MapWind::Outside> parse_outside(std::string_view name) {
  return parse_name<MapWind::Outside>("rule outside the map", name, outside_names);
}

Result<MapWind> MapWind::create(tile::Map map, const std::vector<std::string>& bands, Outside outside) {
  const tile::MapDescription& about = map.description();
  if (!about.role.empty() && about.role != tile::to_string(tile::Role::Field))
    return fail(Error::Kind::Malformed,
                fmt::format("{}: expected a map of role field, found role {}", about.path, about.role));
  std::vector<int> numbers;
  for (const std::string& name : bands) {
    const auto band = about.find_band(name);
    if (!band) return fail(band);
    numbers.push_back(*band);
  }
  if (bands.empty()) numbers = about.data_bands();
  if (bands.empty() && numbers.size() > 2) numbers.resize(2);
  if (numbers.size() != 2)
    return fail(Error::Kind::Malformed,
                fmt::format("{}: expected two bands, wind towards east and towards north, found {}", about.path,
                            numbers.size()));
  const auto type = map.sample_type(numbers);
  if (!type) return fail(type);
  return MapWind(std::move(map), {numbers[0], numbers[1]}, outside);
}

Result<const MapWind::Block*> MapWind::block(std::int32_t col, std::int32_t row) {
  for (const Block& held : blocks_)
    if (held.col == col && held.row == row) return &held;
  const tile::Window window{col * block_side, row * block_side, std::min(block_side, map_.width() - col * block_side),
                            std::min(block_side, map_.height() - row * block_side)};
  auto texels = map_.read(0, window, bands_);
  if (!texels) return fail(texels);
  Block& place = blocks_[oldest_];
  oldest_ = (oldest_ + 1) % blocks_.size();
  place = {col, row, std::move(*texels)};
  return &place;
}

Result<Vector3d> MapWind::towards_ned_mps(const AirPlace& place) {
  const geodesy::Geodetic where = geodesy::geodetic_from_ecef(place.position);
  std::array<Vector2d, 1> point = {Vector2d(where.lon_rad, where.lat_rad)};
  map_.projection().crs_from_lon_lat(point);
  Vector2d texel = map_.texel_from_crs() * point[0];
  if (!texel.allFinite()) return Vector3d::Zero().eval();  // a place that the map's CRS does not know

  // Texel centres around the place, as whole numbers
  const bool around = map_.goes_around();
  const Vector2d size(map_.width(), map_.height());
  const bool inside = (around || (texel.x() >= 0 && texel.x() <= size.x())) && texel.y() >= 0 && texel.y() <= size.y();
  if (!inside && outside_ == Outside::Calm) return Vector3d::Zero().eval();
  texel -= Vector2d(0.5, 0.5);
  if (!around) texel.x() = std::clamp(texel.x(), 0.0, size.x() - 1);
  texel.y() = std::clamp(texel.y(), 0.0, size.y() - 1);
  const Vector2d first = texel.array().floor();
  const Vector2d share = texel - first;

  Vector2d sum = Vector2d::Zero();
  double weights = 0;
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx) {
      const double weight = (dx ? share.x() : 1 - share.x()) * (dy ? share.y() : 1 - share.y());
      if (weight == 0) continue;  // may lie off the map
      const double turns = around ? std::floor((first.x() + dx) / size.x()) : 0;
      const auto col = static_cast<std::int32_t>(first.x() + dx - turns * size.x());
      const auto row = static_cast<std::int32_t>(first.y()) + dy;
      const auto held = block(col / block_side, row / block_side);
      if (!held) return fail(held);
      if (const auto wind = sample((*held)->texels, col, row)) {
        sum += weight * *wind;
        weights += weight;
      }
    }
  if (weights == 0) return Vector3d::Zero().eval();
  const auto metres_a_second = [&](int i) {
    const tile::Band& band =
        map_.description().bands[static_cast<std::size_t>(bands_[static_cast<std::size_t>(i)] - 1)];
    return sum[i] / weights * band.scale + band.offset;
  };
  return Vector3d(metres_a_second(1), metres_a_second(0), 0);
}

}  // namespace nadir::sim

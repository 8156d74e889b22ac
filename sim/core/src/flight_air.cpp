#include "flight_air.h"

#include <fmt/format.h>

#include "scene_place.h"

namespace nadir::sim {

Result<std::vector<std::unique_ptr<WindSource>>> make_winds(const RunFile& run) {
  const AirSetup& air = run.air;
  std::vector<std::unique_ptr<WindSource>> winds;
  winds.push_back(std::make_unique<SteadyWind>(
      wind_towards_ned_mps(geodesy::to_radians(air.wind_from_deg), air.wind_speed_mps, air.wind_up_mps), air.shear));
  if (!air.field) return winds;
  auto map = tile::Map::open(run.resolve(air.field->map).string());
  if (!map) return fail(map.error().kind, fmt::format("air.field: {}", map.error().message));
  auto wind = MapWind::create(std::move(*map), air.field->bands, air.field->outside);
  if (!wind) return fail(wind.error().kind, fmt::format("air.field: {}", wind.error().message));
  winds.push_back(std::make_unique<MapWind>(std::move(*wind)));
  return winds;
}

Result<Eigen::Vector3d> wind_at(const std::vector<std::unique_ptr<WindSource>>& winds,
                                const geodesy::Point<geodesy::frame::Ecef>& place, const render::Surface& ground) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& wind : winds) {
    const auto part = wind->towards_ned_mps({0, place, height_above_ground_m(ground, place)});
    if (!part) return part;
    sum += *part;
  }
  return sum;
}

Result<AirParts> make_air(const RunFile& run, const std::string& name, double span_m, const render::Surface& ground) {
  AirParts parts;
  parts.height_above_ground_m = [ground](const geodesy::Point<geodesy::frame::Ecef>& place) {
    return height_above_ground_m(ground, place);
  };
  auto winds = make_winds(run);
  if (!winds) return fail(winds);
  parts.sources = std::move(*winds);
  parts.gusts = run.air.gusts;
  if (run.air.turbulence)
    parts.turbulence =
        Turbulence(run.air.turbulence->wind_at_20ft_mps(), span_m, RandomStream(run.seed, "turbulence/" + name));
  return parts;
}

}  // namespace nadir::sim

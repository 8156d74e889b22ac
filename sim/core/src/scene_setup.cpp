#include "nadir/sim/scene_setup.h"

#include <fmt/format.h>

#include <vector>

namespace nadir::sim {

Result<render::LayerOptions> layer_options(const tile::Map& map, const MapSetup& setup,
                                           std::optional<tile::SampleType> output,
                                           const std::optional<std::pair<double, double>>& range) {
  render::LayerOptions options;
  if (setup.role) {
    options.role = *setup.role;
  } else if (!map.description().role.empty()) {
    const auto own = tile::parse_role(map.description().role);
    if (!own) return fail(own.error().kind, fmt::format("{}: {}", map.description().path, own.error().message));
    options.role = *own;
  }
  options.radar_scale = setup.radar_scale;
  for (const std::string& name : setup.bands) {
    const auto band = map.description().find_band(name);
    if (!band) return fail(band);
    options.bands.push_back(*band);
  }
  if (!output && !range) return options;

  const auto own_type = map.sample_type(options.bands.empty() ? map.description().data_bands() : options.bands);
  if (!own_type) return fail(own_type);
  render::Output scaled{output.value_or(*own_type)};
  if (range) {
    scaled.low = range->first;
    scaled.high = range->second;
  } else if (scaled.type == *own_type) {
    return options;
  } else if (scaled.type != tile::SampleType::Float32) {
    const auto natural = render::natural_output(*own_type);
    if (!natural)
      return fail(
          Error::Kind::Malformed,
          fmt::format(
              "{}: output {} of a map of {} needs a range: the map values that become the darkest and the brightest",
              map.description().path, tile::to_string(scaled.type), tile::to_string(*own_type)));
    scaled.low = natural->low;
    scaled.high = natural->high;
  }
  options.output = scaled;
  return options;
}

Result<render::Surface> ground_surface(SurfaceShape shape, const std::optional<OriginSetup>& origin,
                                       const geodesy::TypedHeight& ground, const tile::Map& first_map) {
  geodesy::Geodetic place =
      origin ? geodesy::Geodetic::degrees(origin->lat_deg, origin->lon_deg, 0) : first_map.center();
  const auto ground_m = geodesy::ellipsoidal_height_m(ground, place.lat_rad, place.lon_rad, 0);
  if (!ground_m) return fail(ground_m);
  place.height_m = *ground_m;
  if (origin) {
    const auto height_m = geodesy::ellipsoidal_height_m(origin->height, place.lat_rad, place.lon_rad, *ground_m);
    if (!height_m) return fail(height_m);
    place.height_m = *height_m;
  }
  if (shape == SurfaceShape::Ellipsoid) return render::Surface(render::Ellipsoid(place, *ground_m));
  return render::Surface(render::Plane(place, *ground_m));
}

}  // namespace nadir::sim

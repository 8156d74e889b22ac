#include "nadir/render/scene.h"

#include <fmt/format.h>

#include <array>

namespace nadir::render {
namespace {

/// Palette indices are names, not amounts: blending two of them gives a third one's colour.
Result<void> refuse_palette(const tile::Map& map, const LayerOptions& options, const std::vector<int>& bands) {
  if (options.role == tile::Role::Labels) return {};
  for (const int number : bands)
    if (map.description().bands[static_cast<std::size_t>(number) - 1].color == "Palette")
      return fail(Error::Kind::Unsupported, fmt::format("{}: band {} holds palette indices, which cannot be blended: "
                                                        "use role labels, or expand it with gdal_translate -expand rgb",
                                                        map.description().path, number));
  return {};
}

/// A plane shows what is near its origin: no map in a CRS that has no coordinates there.
Result<void> check_origin(const Surface& surface, const tile::Map& map) {
  const Plane* plane = surface.plane();
  if (!plane) return {};
  const geodesy::Geodetic& origin = plane->frame().origin();
  std::array<Eigen::Vector2d, 1> crs = {Eigen::Vector2d(origin.lon_rad, origin.lat_rad)};
  map.projection().crs_from_lon_lat(crs);
  if (crs[0].allFinite()) return {};
  return fail(Error::Kind::Unsupported,
              fmt::format("{}: the scene's origin at latitude {:.6g}, longitude {:.6g} lies where its CRS {} is not "
                          "defined: choose an origin on the map, or warp the map to a CRS for that place with gdalwarp "
                          "-t_srs",
                          map.description().path, geodesy::to_degrees(origin.lat_rad),
                          geodesy::to_degrees(origin.lon_rad), map.projection().name()));
}

Result<void> check_output(const std::string& name, const std::optional<Output>& output) {
  if (output && output->type != tile::SampleType::Float32 && !(output->high > output->low))
    return fail(Error::Kind::Malformed,
                fmt::format("layer {}: expected an output range with low < high, found {} to {}", name, output->low,
                            output->high));
  return {};
}

}  // namespace

Scene Scene::plane(const geodesy::Geodetic& origin, const PlaneOptions& options) {
  return Scene(Plane(origin, options.height_m));
}

Scene Scene::ellipsoid(const geodesy::Geodetic& origin, double height_m) { return Scene(Ellipsoid(origin, height_m)); }

Scene Scene::with_layer(std::string name, const tile::Map& map, LayerOptions options) const {
  Scene scene = *this;
  if (scene.problem_) return scene;
  const auto add = [&]() -> Result<void> {
    for (const Layer& other : layers_)
      if (other.name == name)
        return fail(Error::Kind::Malformed, fmt::format("layer '{}' is there twice: give each its own name", name));
    const bool floats = [&] {
      const auto type = map.sample_type(options.bands.empty() ? map.description().data_bands() : options.bands);
      return type && *type == tile::SampleType::Float32;
    }();
    const bool decibel = options.role == tile::Role::Radar &&
                         options.radar_scale.value_or(tile::usual_radar_scale(floats)) == tile::RadarScale::Decibel;
    auto source = tile::CellSource::make(map, options.bands, decibel ? tile::Domain::Decibel : tile::Domain::Linear);
    if (!source) return fail(source);
    if (auto ok = check_origin(surface_, map); !ok) return ok;
    if (auto ok = refuse_palette(map, options, (*source)->bands()); !ok) return ok;
    if (auto ok = check_output(name, options.output); !ok) return ok;
    const GroundExtent extent =
        ground_extent(surface_, map.projection(), map.crs_from_texel(), map.width(), map.height());
    scene.layers_.push_back({std::move(name), std::move(options), std::move(*source), extent});
    return {};
  };
  if (auto added = add(); !added) scene.problem_ = added.error();
  return scene;
}

Result<void> Scene::check() const {
  if (problem_) return tl::unexpected(*problem_);
  if (layers_.empty()) return fail(Error::Kind::Malformed, "the scene has no layer: add a map");
  return {};
}

}  // namespace nadir::render

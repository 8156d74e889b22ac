#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nadir/render/output.h"
#include "nadir/render/patches.h"
#include "nadir/tile/cell_source.h"

namespace nadir::render {

/// What a layer's values mean, which says how they may be averaged.
enum class Role { optical, radar, infrared, elevation, labels, field };
std::string_view to_string(Role role);
Result<Role> parse_role(std::string_view text);

/// How a radar map stores backscatter. Decibels are averaged in power.
enum class RadarScale { decibel, linear };

struct LayerOptions {
  Role role = Role::optical;
  std::vector<int> bands;  // data bands, numbers from 1, in the order of the frame; all where empty
  std::optional<RadarScale> radar_scale;  // of role radar; by default decibel for maps of floats, else linear
  std::optional<Output> output;           // by default the map's own type and values
};

/// A map in a scene, with its part of the plan that no frame changes.
struct Layer {
  std::string name;
  LayerOptions options;
  std::shared_ptr<const tile::CellSource> source;
  PlaneExtent extent;
};

struct PlaneOptions {
  double height_m = 0;  // of the plane, above the ellipsoid at the scene origin
};

/// What there is to see: a surface and maps on it. A value; copies share the maps.
class Scene {
 public:
  /// The ground as a plane, level at the scene origin.
  static Scene plane(const geodesy::Geodetic& origin, const PlaneOptions& options);

  /// This scene and one more layer. What is wrong with it (an unknown band, a name taken) is reported by `check`, and by
  /// whoever renders the scene.
  Scene with_layer(std::string name, const tile::Map& map, LayerOptions options = {}) const;

  Result<void> check() const;
  const Plane& surface() const { return surface_; }
  const std::vector<Layer>& layers() const { return layers_; }

 private:
  explicit Scene(const Plane& surface) : surface_(surface) {}
  Plane surface_;
  std::vector<Layer> layers_;
  std::optional<Error> problem_;  // the first
};

}  // namespace nadir::render

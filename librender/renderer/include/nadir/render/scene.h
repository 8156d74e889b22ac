#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nadir/render/output.h"
#include "nadir/render/patches.h"
#include "nadir/tile/cell_source.h"
#include "nadir/tile/role.h"

namespace nadir::render {

struct LayerOptions {
  tile::Role role = tile::Role::Optical;
  std::vector<int> bands;  // data bands, numbers from 1, in the order of the frame; all where empty
  std::optional<tile::RadarScale> radar_scale;  // of role Radar; else tile::usual_radar_scale
  std::optional<Output> output;                 // by default the map's own type and values
};

/// A map in a scene, with its part of the plan that no frame changes.
struct Layer {
  std::string name;
  LayerOptions options;
  std::shared_ptr<const tile::CellSource> source;
  GroundExtent extent;
};

struct PlaneOptions {
  double height_m = 0;  // of the plane, above the ellipsoid at the scene origin
};

/// What there is to see: a surface and maps on it. A value; copies share the maps.
class Scene {
 public:
  /// The ground as a plane, level at the scene origin.
  static Scene plane(const geodesy::Geodetic& origin, const PlaneOptions& options);
  /// The curved Earth at one height above the WGS-84 ellipsoid. `origin`: of local coordinates.
  static Scene ellipsoid(const geodesy::Geodetic& origin, double height_m);
  static Scene over(const Surface& surface) { return Scene(surface); }

  /// This scene and one more layer. What is wrong with it (an unknown band, a name taken) is reported by `check`, and
  /// by whoever renders the scene.
  Scene with_layer(std::string name, const tile::Map& map, LayerOptions options = {}) const;

  Result<void> check() const;
  const Surface& surface() const { return surface_; }
  const std::vector<Layer>& layers() const { return layers_; }

 private:
  explicit Scene(const Surface& surface) : surface_(surface) {}
  Surface surface_;
  std::vector<Layer> layers_;
  std::optional<Error> problem_;  // the first
};

}  // namespace nadir::render

#pragma once

#include "nadir/render/renderer.h"
#include "support/synthetic_map.h"

namespace nadir::test {

/// A map of square texels in UTM zone 14 whose middle is on the zone's axis at 47 N.
inline SyntheticMap utm_map(int side, double texel_m) {
  SyntheticMap map;
  map.width = map.height = side;
  map.crs = "EPSG:32614";
  map.geotransform = {500000 - side * texel_m / 2, texel_m, 0, 5205000 + side * texel_m / 2, 0, -texel_m};
  return map;
}

/// Straight down over a map's middle, image top to the north.
inline render::CameraPose over_centre(const tile::Map& map, double height_m) {
  geodesy::Geodetic place = map.center();
  place.height_m = height_m;
  return render::look_down(place, geodesy::Degrees{0});
}

inline render::Camera square_camera(int side_px, double focal_px) {
  return render::Camera::pinhole(side_px, side_px, focal_px, focal_px, side_px / 2.0, side_px / 2.0).value();
}

}  // namespace nadir::test

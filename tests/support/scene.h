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

/// A map as renderers meet them: bytes of three bands, without an order, with levels and holes.
inline SyntheticMap busy_map() {
  SyntheticMap map = utm_map(2048, 1);
  map.type = GDT_Byte;
  map.bands = 3;
  map.factors = {2, 4, 8};
  map.value = [](int level, int band, int col, int row) {
    return (col * 7919 + row * 104729 + band * 31 + level * 17) % 251;
  };
  map.mask = true;
  map.mask_value = [](int col, int row) { return (col / 50 + row / 70) % 5 == 0 ? 0 : 255; };
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

#include "scene_place.h"

namespace nadir::sim {

using namespace geodesy;

Point<frame::Ecef> ecef_from_scene(const ScenePlace& place, const render::Surface& ground) {
  return ground.frame().ecef_from_enu() *
         Point<frame::Enu>{{place.north_east_m.y(), place.north_east_m.x(), place.height_m}};
}

double height_above_ground_m(const render::Surface& ground, const Point<frame::Ecef>& place) {
  if (ground.plane()) return (ground.frame().enu_from_ecef() * place).xyz.z() - ground.up_m();
  return geodetic_from_ecef(place).height_m - ground.height_m();
}

Result<ScenePlace> place_in_scene(const PlaceSetup& setup, const TypedHeight& height, const render::Surface& ground) {
  const Geodetic& origin = ground.frame().origin();
  const auto at_origin_m = ellipsoidal_height_m(height, origin.lat_rad, origin.lon_rad, ground.height_m());
  if (!at_origin_m) return fail(at_origin_m);
  ScenePlace place{{setup.north_m, setup.east_m}, *at_origin_m - origin.height_m};
  if (setup.geodetic) {
    const Geodetic over = Geodetic::degrees(setup.geodetic->lat_deg, setup.geodetic->lon_deg, *at_origin_m);
    const Eigen::Vector3d p_enu = (ground.frame().enu_from_ecef() * ecef_from_geodetic(over)).xyz;
    place.north_east_m = {p_enu.y(), p_enu.x()};
  }
  if (ground.plane()) return place;

  // Over the curved Earth, up is nearly the normal: each step leaves the square of the angle between, times the last
  for (int i = 0; i < 4; ++i) {
    const Geodetic here = geodetic_from_ecef(ecef_from_scene(place, ground));
    const auto wanted_m = ellipsoidal_height_m(height, here.lat_rad, here.lon_rad, ground.height_m());
    if (!wanted_m) return fail(wanted_m);
    place.height_m += *wanted_m - here.height_m;
  }
  return place;
}

}  // namespace nadir::sim

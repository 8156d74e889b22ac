#include "nadir/geodesy/geodetic.h"

#include <GeographicLib/Geocentric.hpp>

namespace nadir::geodesy {
using GeographicLib::Geocentric;

// GeographicLib takes and gives degrees. The detour through them costs at most two roundings, 1e-9 m on the ground.
Point<frame::Ecef> ecef_from_geodetic(const Geodetic& place) {
  Point<frame::Ecef> point;
  Geocentric::WGS84().Forward(to_degrees(place.lat_rad), to_degrees(place.lon_rad), place.height_m, point.xyz.x(),
                              point.xyz.y(), point.xyz.z());
  return point;
}

Geodetic geodetic_from_ecef(const Point<frame::Ecef>& point) {
  double lat_deg = 0, lon_deg = 0, height_m = 0;
  Geocentric::WGS84().Reverse(point.xyz.x(), point.xyz.y(), point.xyz.z(), lat_deg, lon_deg, height_m);
  return Geodetic::degrees(lat_deg, lon_deg, height_m);
}

LocalFrame::LocalFrame(const Geodetic& origin) : origin_(origin) {
  // Columns are the east, north and up directions in ECEF.
  const double sin_lat = std::sin(origin.lat_rad), cos_lat = std::cos(origin.lat_rad);
  const double sin_lon = std::sin(origin.lon_rad), cos_lon = std::cos(origin.lon_rad);
  Eigen::Matrix3d axes;
  axes << -sin_lon, -sin_lat * cos_lon, cos_lat * cos_lon,  //
      cos_lon, -sin_lat * sin_lon, cos_lat * sin_lon,       //
      0, cos_lat, sin_lat;
  ecef_from_enu_ = {Eigen::Quaterniond(axes).normalized(), ecef_from_geodetic(origin).xyz};
  enu_from_ecef_ = ecef_from_enu_.inverse();
}

Rotation<frame::Enu, frame::Ned> enu_from_ned() {
  const double half = std::sqrt(0.5);
  return {Eigen::Quaterniond(0, half, half, 0)};  // half a turn about the axis between north and east
}

Pose<frame::Ecef, frame::Ned> ecef_from_ned(const Geodetic& place) {
  const LocalFrame local(place);
  return {(local.ecef_from_enu().rotation * enu_from_ned().quaternion).normalized(), local.ecef_from_enu().origin};
}

}  // namespace nadir::geodesy

#include "nadir/render/plane.h"

namespace nadir::render {
using namespace geodesy;

std::optional<Point<frame::Enu>> Plane::hit(const Point<frame::Enu>& from,
                                            const Direction<frame::Enu>& direction) const {
  const double above_m = from.xyz.z() - up_m();
  const double sink = -direction.xyz.z();
  if (!(above_m > 0) || !(sink > 0)) return std::nullopt;
  Point<frame::Enu> point{from.xyz + direction.xyz * (above_m / sink)};
  point.xyz.z() = up_m();
  if (!point.xyz.allFinite()) return std::nullopt;
  return point;
}

std::optional<Point<frame::Enu>> Plane::at(double lon_rad, double lat_rad) const {
  const Point<frame::Enu> foot = frame_.enu_from_ecef() * ecef_from_geodetic({lat_rad, lon_rad, 0});
  const Point<frame::Enu> above = frame_.enu_from_ecef() * ecef_from_geodetic({lat_rad, lon_rad, 1});
  const Eigen::Vector3d normal = above.xyz - foot.xyz;
  if (!(normal.z() > 1e-6)) return std::nullopt;
  return Point<frame::Enu>{foot.xyz + normal * ((up_m() - foot.xyz.z()) / normal.z())};
}

}  // namespace nadir::render

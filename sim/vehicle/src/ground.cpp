#include "nadir/sim/ground.h"

#include <cmath>

namespace nadir::sim {
using geodesy::Point, geodesy::frame::Ecef;

GroundUnder PlaneGround::under(const Point<Ecef>& place) const {
  return {(frame_.enu_from_ecef() * place).xyz.z() - up_m_, frame_.ecef_from_enu().rotation * Eigen::Vector3d::UnitZ()};
}

GroundUnder EllipsoidGround::under(const Point<Ecef>& place) const {
  const geodesy::Geodetic geodetic = geodesy::geodetic_from_ecef(place);
  const double cos_lat = std::cos(geodetic.lat_rad);
  return {geodetic.height_m - height_m_,
          {cos_lat * std::cos(geodetic.lon_rad), cos_lat * std::sin(geodetic.lon_rad), std::sin(geodetic.lat_rad)}};
}

}  // namespace nadir::sim

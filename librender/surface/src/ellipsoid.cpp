#include "nadir/render/ellipsoid.h"

#include <algorithm>
#include <cmath>

namespace nadir::render {
using namespace geodesy;

namespace {
constexpr double equatorial_radius_m = 6378137, flattening = 1 / 298.257223563;  // WGS-84
constexpr double polar_radius_m = equatorial_radius_m * (1 - flattening);
}  // namespace

Ellipsoid::Ellipsoid(const Geodetic& origin, double height_m)
    : frame_(origin),
      height_m_(height_m),
      per_semi_axis_(1 / (equatorial_radius_m + height_m), 1 / (equatorial_radius_m + height_m),
                     1 / (polar_radius_m + height_m)) {}

std::optional<Point<frame::Ecef>> Ellipsoid::hit(const Point<frame::Ecef>& from,
                                                 const Direction<frame::Ecef>& direction) const {
  // What a double tells of a point's height, at the Earth's radius and at the camera's
  const double rounding_m = 1e-8 + 4e-16 * from.xyz.norm();
  const double above_m = geodetic_from_ecef(from).height_m - height_m_;
  if (!(above_m > rounding_m)) return std::nullopt;
  const Eigen::Vector3d ray = direction.xyz.normalized();
  const Eigen::Vector3d p = to_unit_sphere(from.xyz), d = to_unit_sphere(ray);
  // |p + t d|^2 = 1
  const double dd = d.squaredNorm(), pd = p.dot(d), beyond = std::max(p.squaredNorm() - 1, 0.0);
  if (!(pd < 0)) return std::nullopt;
  const double discriminant = pd * pd - dd * beyond;
  if (!(discriminant >= 0)) return std::nullopt;
  double t = beyond / (-pd + std::sqrt(discriminant));
  bool converged = false;
  for (int step = 0; step < 8 && !converged; ++step) {
    const Point<frame::Ecef> point{from.xyz + t * ray};
    const Geodetic place = geodetic_from_ecef(point);
    const Eigen::Vector3d up(std::cos(place.lat_rad) * std::cos(place.lon_rad),
                             std::cos(place.lat_rad) * std::sin(place.lon_rad), std::sin(place.lat_rad));
    const double off_m = place.height_m - height_m_, sink = -up.dot(ray);
    if (!(sink > 0)) return std::nullopt;  // it leaves again: past the first hit
    t += off_m / sink;
    converged = std::abs(off_m) <= rounding_m;
  }
  const Point<frame::Ecef> point{from.xyz + t * ray};
  if (!converged || !(t > 0) || !point.xyz.allFinite()) return std::nullopt;
  return point;
}

}  // namespace nadir::render

#include "nadir/sim/environment.h"

#include <cmath>

namespace nadir::sim {
namespace {
using Eigen::Vector3d;

// WGS-84 (NGA.STND.0036, 2014): semi-axes, the Earth's attraction and rate; zonal harmonics of its normal gravity.
constexpr double a_m = 6378137;
constexpr double b_m = 6356752.314245179;
constexpr double e2 = 1 - (b_m / a_m) * (b_m / a_m);
constexpr double gm_m3ps2 = 3.986004418e14;
constexpr double earth_rate_radps = 7.292115e-5;
constexpr double j2 = 1.082629821257e-3;
constexpr double j4 = -2.37091120e-6;
constexpr double j6 = 6.08346498e-9;

/// Gradient of the potential of attraction and rotation. The next harmonic, J8 = -1.4e-11, is left out: 6e-9 m/s^2.
/// Source: Heiskanen and Moritz, Physical Geodesy, 1967, section 2-9, differentiated: the harmonic of degree n pulls
/// with J_n (a/r)^n GM/r^2 times P'_(n+1)(s) outwards and -P'_n(s) along the axis, where s is the sine of latitude.
Vector3d normal_gravity(const Vector3d& p) {
  const double over_r = 1 / p.norm(), over_r2 = over_r * over_r;
  const double s = p.z() * over_r, s2 = s * s;
  const double ratio2 = a_m * a_m * over_r2, c2 = j2 * ratio2, c4 = j4 * ratio2 * ratio2,
               c6 = j6 * ratio2 * ratio2 * ratio2;
  const double outwards = -1 + c2 * (15 * s2 - 3) / 2 + c4 * ((315 * s2 - 210) * s2 + 15) / 8 +
                          c6 * (((3003 * s2 - 3465) * s2 + 945) * s2 - 35) / 16;
  const double along_axis = -s * (c2 * 3 + c4 * (35 * s2 - 15) / 2 + c6 * ((693 * s2 - 630) * s2 + 105) / 8);
  Vector3d g = (gm_m3ps2 * over_r2) * (outwards * over_r * p + along_axis * Vector3d::UnitZ());
  g.head<2>() += earth_rate_radps * earth_rate_radps * p.head<2>();
  return g;
}

}  // namespace

Environment Environment::wgs84(double sea_level_m, const Atmosphere& atmosphere) {
  Environment environment;
  environment.sea_level_m_ = sea_level_m;
  environment.atmosphere_ = atmosphere;
  return environment;
}

Environment Environment::flat(const geodesy::Geodetic& origin, double gravity_mps2, double density_kgpm3) {
  Environment environment;
  environment.flat_ = true;
  const auto ecef_from_ned = geodesy::ecef_from_ned(origin);
  environment.origin_ecef_ = ecef_from_ned.origin;
  Surroundings& everywhere = environment.at_origin_;
  everywhere.ecef_from_ned = ecef_from_ned.rotation.toRotationMatrix();
  everywhere.gravity_ecef_mps2 = gravity_mps2 * everywhere.ecef_from_ned.col(2);
  everywhere.earth_rate_ecef_radps.setZero();
  everywhere.density_kgpm3 = density_kgpm3;
  return environment;
}

Surroundings Environment::at(const geodesy::Point<geodesy::frame::Ecef>& place) const {
  const Vector3d& p = place.xyz;
  if (flat_) {
    Surroundings here = at_origin_;
    here.height_m = -here.ecef_from_ned.col(2).dot(p - origin_ecef_);
    return here;
  }

  // Latitude by one step of Bowring (The accuracy of geodetic latitude and height equations, 1985), as sines and
  // cosines: off by 1e-11 rad below 100 km, without trigonometry and without dividing by the distance from the axis.
  const double axis_m = std::sqrt(p.x() * p.x() + p.y() * p.y());
  const Eigen::Vector2d reduced = Eigen::Vector2d(b_m * axis_m, a_m * p.z()).normalized();  // cosine, sine
  const Eigen::Vector2d latitude =
      Eigen::Vector2d(axis_m - e2 * a_m * reduced.x() * reduced.x() * reduced.x(),
                      p.z() + e2 / (1 - e2) * b_m * reduced.y() * reduced.y() * reduced.y())
          .normalized();
  const double cos_lat = latitude.x(), sin_lat = latitude.y();
  const double per_axis = axis_m > 0 ? 1 / axis_m : 0;
  const double cos_lon = axis_m > 0 ? p.x() * per_axis : 1, sin_lon = p.y() * per_axis;

  Surroundings here;
  here.ecef_from_ned.col(0) = Vector3d(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat);
  here.ecef_from_ned.col(1) = Vector3d(-sin_lon, cos_lon, 0);
  here.ecef_from_ned.col(2) = Vector3d(-cos_lat * cos_lon, -cos_lat * sin_lon, -sin_lat);
  here.height_m = axis_m * cos_lat + p.z() * sin_lat - a_m * std::sqrt(1 - e2 * sin_lat * sin_lat);
  here.gravity_ecef_mps2 = normal_gravity(p);
  here.earth_rate_ecef_radps = Vector3d(0, 0, earth_rate_radps);
  here.density_kgpm3 = atmosphere_.at(here.height_m - sea_level_m_).density_kgpm3;
  return here;
}

}  // namespace nadir::sim

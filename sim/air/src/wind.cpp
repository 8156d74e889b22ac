#include "nadir/sim/wind.h"

#include <algorithm>
#include <cmath>

namespace nadir::sim {
using Eigen::Vector3d;

Vector3d wind_towards_ned_mps(double from_rad, double speed_mps, double up_mps) {
  return {-speed_mps * std::cos(from_rad), -speed_mps * std::sin(from_rad), -up_mps};
}

double Shear::factor(double height_above_ground_m) const {
  const double h = std::min(height_above_ground_m, top_m);
  switch (law) {
    case Law::None:
      return 1;
    case Law::Power:
      return h > 0 ? std::pow(h / reference_m, exponent) : 0;
    case Law::Logarithmic:
      return h > roughness_m ? std::log(h / roughness_m) / std::log(reference_m / roughness_m) : 0;
  }
  return 1;
}

Result<Vector3d> SteadyWind::towards_ned_mps(const AirPlace& place) {
  const double factor = shear_.factor(place.height_above_ground_m);
  return Vector3d(factor * at_reference_ned_mps_.x(), factor * at_reference_ned_mps_.y(), at_reference_ned_mps_.z());
}

}  // namespace nadir::sim

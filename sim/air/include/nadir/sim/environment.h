#pragma once

#include <Eigen/Core>

#include "nadir/geodesy/frames.h"
#include "nadir/geodesy/geodetic.h"
#include "nadir/sim/atmosphere.h"

namespace nadir::sim {

/// What the Earth and the air at rest are at one place.
struct Surroundings {
  Eigen::Matrix3d ecef_from_ned;          // columns: north, east, down at this place
  Eigen::Vector3d gravity_ecef_mps2;      // as a plumb bob feels it: with the centrifugal part
  Eigen::Vector3d earth_rate_ecef_radps;  // of ECEF against inertial space
  double height_m = 0;                    // above the ellipsoid, or above the flat Earth's plane
  double density_kgpm3 = 0;
};

/// The Earth that a vehicle flies over. Positions are ECEF in either kind, so a vehicle's state means the same.
class Environment {
 public:
  /// The WGS-84 Earth: it turns, its gravity is the normal gravity of the ellipsoid (error under 1e-8 m/s^2 from the
  /// surface to 100 km), and its air is the International Standard Atmosphere. `sea_level_m`: the geoid's height above
  /// the ellipsoid in the region, since the atmosphere counts from the sea; 100 m of it are 1 % of density.
  static Environment wgs84(double sea_level_m = 0, const Atmosphere& atmosphere = {});

  /// The world of textbooks, for comparison with their numbers: a plane that does not turn, tangent to the ellipsoid at
  /// `origin`, with the same gravity and air everywhere.
  static Environment flat(const geodesy::Geodetic& origin, double gravity_mps2 = 9.81, double density_kgpm3 = 1.2682);

  /// `place`: anywhere but within 100 km of the Earth's centre. At the poles themselves north is that of longitude 0.
  Surroundings at(const geodesy::Point<geodesy::frame::Ecef>& place) const;

 private:
  Environment() = default;

  bool flat_ = false;
  double sea_level_m_ = 0;
  Atmosphere atmosphere_;
  Surroundings at_origin_;  // of the flat Earth
  Eigen::Vector3d origin_ecef_ = Eigen::Vector3d::Zero();
};

}  // namespace nadir::sim

#pragma once

#include <optional>

#include "nadir/geodesy/geodetic.h"

namespace nadir::render {

/// The curved Earth: all points at one height above the WGS-84 ellipsoid.
class Ellipsoid {
 public:
  /// `origin`: of the scene, for local coordinates alone. `height_m`: above the ellipsoid, more than -1000 km.
  Ellipsoid(const geodesy::Geodetic& origin, double height_m);

  /// East-north-up at the scene origin.
  const geodesy::LocalFrame& frame() const { return frame_; }
  double height_m() const { return height_m_; }

  /// First hit of the ray from `from` along `direction` (of any length): along the ellipsoid of semi-axes longer by the
  /// height, from which the surface of equal heights differs by up to 3e-6 of the height, then corrected by Newton's
  /// steps. Empty where the ray misses, begins on the surface or below it, or grazes it so
  /// that the steps find no place.
  /// Error: rounding, about 1e-8 m of height, over the sine of the angle between ray and surface.
  std::optional<geodesy::Point<geodesy::frame::Ecef>> hit(
      const geodesy::Point<geodesy::frame::Ecef>& from,
      const geodesy::Direction<geodesy::frame::Ecef>& direction) const;

  /// Coordinates in which the ellipsoid of those semi-axes is the unit sphere: straight lines stay straight.
  Eigen::Vector3d to_unit_sphere(const Eigen::Vector3d& ecef) const { return ecef.cwiseProduct(per_semi_axis_); }

 private:
  geodesy::LocalFrame frame_;
  double height_m_;
  Eigen::Vector3d per_semi_axis_;
};

}  // namespace nadir::render

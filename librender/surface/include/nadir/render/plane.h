#pragma once

#include <optional>

#include "nadir/geodesy/geodetic.h"

namespace nadir::render {

/// The ground as a plane: tangent to the ellipsoid below the scene origin, raised to a height. It leaves the ellipsoid
/// by d^2 / 2R at distance d: 2 cm at 500 m, 8 m at 10 km.
class Plane {
 public:
  /// `height_m`: of the plane above the ellipsoid at the origin.
  Plane(const geodesy::Geodetic& origin, double height_m) : frame_(origin), height_m_(height_m) {}

  /// East-north-up at the scene origin.
  const geodesy::LocalFrame& frame() const { return frame_; }
  double height_m() const { return height_m_; }
  /// The plane's up coordinate in that frame.
  double up_m() const { return height_m_ - frame_.origin().height_m; }

  /// First hit of the ray from `from` along `direction` (of any length); empty where it looks away from the plane's
  /// upper side or starts below it.
  std::optional<geodesy::Point<geodesy::frame::Enu>> hit(
      const geodesy::Point<geodesy::frame::Enu>& from, const geodesy::Direction<geodesy::frame::Enu>& direction) const;

  /// The plane's point that stands over (or under) a place, along the ellipsoid's normal there: where it appears on a
  /// map. Empty for places from a quarter turn away on, which the plane does not reach.
  std::optional<geodesy::Point<geodesy::frame::Enu>> at(double lon_rad, double lat_rad) const;

 private:
  geodesy::LocalFrame frame_;
  double height_m_;
};

}  // namespace nadir::render

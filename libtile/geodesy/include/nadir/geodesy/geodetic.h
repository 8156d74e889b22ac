#pragma once

#include <numbers>

#include "nadir/geodesy/frames.h"

namespace nadir::geodesy {

/// An angle as people type it; becomes radians the moment it is used.
struct Degrees {
  double value;
  constexpr double radians() const { return value * (std::numbers::pi / 180.0); }
};
constexpr double to_degrees(double radians) { return radians * (180.0 / std::numbers::pi); }
constexpr double to_radians(double degrees) { return Degrees{degrees}.radians(); }

/// A place over the WGS-84 ellipsoid.
struct Geodetic {
  double lat_rad = 0;   // [-pi/2, pi/2], north positive
  double lon_rad = 0;   // [-pi, pi], east positive
  double height_m = 0;  // above the ellipsoid

  static Geodetic degrees(double lat_deg, double lon_deg, double height_m) {
    return {to_radians(lat_deg), to_radians(lon_deg), height_m};
  }
};

/// Closed form. Error: rounding, under 1e-8 m up to 1e7 m above the ellipsoid.
Point<frame::Ecef> ecef_from_geodetic(const Geodetic& place);

/// Error: under 1e-8 m in position from 5000 km below the surface outwards.
/// Source: GeographicLib::Geocentric (Karney, Geodesics on an ellipsoid of revolution, 2011, appendix B).
Geodetic geodetic_from_ecef(const Point<frame::Ecef>& point);

/// East-north-up at a place: up is the ellipsoid's normal, so the frame's plane is tangent there.
class LocalFrame {
 public:
  explicit LocalFrame(const Geodetic& origin);

  const Geodetic& origin() const { return origin_; }
  const Pose<frame::Ecef, frame::Enu>& ecef_from_enu() const { return ecef_from_enu_; }
  const Pose<frame::Enu, frame::Ecef>& enu_from_ecef() const { return enu_from_ecef_; }

 private:
  Geodetic origin_;
  Pose<frame::Ecef, frame::Enu> ecef_from_enu_;
  Pose<frame::Enu, frame::Ecef> enu_from_ecef_;
};

/// Axes swap: north is ENU's y, east its x, down its -z. Its own inverse.
Rotation<frame::Enu, frame::Ned> enu_from_ned();

/// Pose of a north-east-down frame whose origin is `place`.
Pose<frame::Ecef, frame::Ned> ecef_from_ned(const Geodetic& place);

}  // namespace nadir::geodesy

#pragma once

#include <Eigen/Core>

#include "nadir/geodesy/frames.h"
#include "nadir/geodesy/geodetic.h"

namespace nadir::sim {

/// The ground at one place, as the plane that touches it there.
struct GroundUnder {
  double height_m = 0;  // of the place above that plane, along its normal; negative below
  Eigen::Vector3d normal_ecef = Eigen::Vector3d::UnitZ();  // up, of unit length
};

/// What a vehicle can touch. `const` members are safe together.
class Ground {
 public:
  virtual ~Ground() = default;
  virtual GroundUnder under(const geodesy::Point<geodesy::frame::Ecef>& place) const = 0;
  /// No ground is nearer to `place` than this; nothing where it is at or below the ground.
  virtual double clear_m(const geodesy::Point<geodesy::frame::Ecef>& place) const = 0;
};

/// A plane parallel to a local frame's tangent plane.
class PlaneGround final : public Ground {
 public:
  PlaneGround(const geodesy::LocalFrame& frame, double up_m) : frame_(frame), up_m_(up_m) {}
  GroundUnder under(const geodesy::Point<geodesy::frame::Ecef>& place) const override;
  double clear_m(const geodesy::Point<geodesy::frame::Ecef>& place) const override { return under(place).height_m; }

 private:
  geodesy::LocalFrame frame_;
  double up_m_;
};

/// The surface of one height above the ellipsoid.
class EllipsoidGround final : public Ground {
 public:
  explicit EllipsoidGround(double height_m) : height_m_(height_m) {}
  GroundUnder under(const geodesy::Point<geodesy::frame::Ecef>& place) const override;
  double clear_m(const geodesy::Point<geodesy::frame::Ecef>& place) const override { return under(place).height_m; }

 private:
  double height_m_;
};

}  // namespace nadir::sim

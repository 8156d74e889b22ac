#pragma once

#include <cmath>

#include "nadir/sim/ground.h"

namespace nadir::sim {

/// A plane through the origin of a local frame that falls towards the east.
class SlopeEast final : public Ground {
 public:
  SlopeEast(const geodesy::LocalFrame& frame, double slope_rad)
      : frame_(frame), normal_enu_(std::sin(slope_rad), 0, std::cos(slope_rad)) {}
  GroundUnder under(const geodesy::Point<geodesy::frame::Ecef>& place) const override {
    return {normal_enu_.dot((frame_.enu_from_ecef() * place).xyz), frame_.ecef_from_enu().rotation * normal_enu_};
  }
  double clear_m(const geodesy::Point<geodesy::frame::Ecef>& place) const override { return under(place).height_m; }

 private:
  geodesy::LocalFrame frame_;
  Eigen::Vector3d normal_enu_;
};

}  // namespace nadir::sim

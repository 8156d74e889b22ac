#pragma once

#include <Eigen/Core>

#include "nadir/base/result.h"
#include "nadir/geodesy/frames.h"

namespace nadir::sim {

/// When and where wind is asked for.
struct AirPlace {
  double time_s = 0;
  geodesy::Point<geodesy::frame::Ecef> position{Eigen::Vector3d::Zero()};
  double height_above_ground_m = 0;
};

/// A part of the wind that is a function of time and place. One thread at a time: it may keep what it read last, which
/// changes no result.
class WindSource {
 public:
  virtual ~WindSource() = default;
  /// Where the air goes, along north, east and down at the place.
  virtual Result<Eigen::Vector3d> towards_ned_mps(const AirPlace& place) = 0;
};

/// Where the air goes of a wind as forecasts tell it. `from_rad`: where it blows from, clockwise from north.
Eigen::Vector3d wind_towards_ned_mps(double from_rad, double speed_mps, double up_mps);

/// How wind grows with height above ground.
struct Shear {
  enum class Law {
    None,
    Power,        // (h / reference)^exponent
    Logarithmic,  // ln(h / roughness) / ln(reference / roughness), none below the roughness
  };
  Law law = Law::None;
  double reference_m = 10;    // where the wind is as given
  double exponent = 0.143;    // 1/7: open country, neutral air
  double roughness_m = 0.03;  // short grass; towns: 1
  double top_m = 300;         // from here on it no longer grows

  /// Wind at a height by that at the reference; no less than 0.
  double factor(double height_above_ground_m) const;
};

/// The same wind everywhere, or growing with height. Vertical wind does not grow.
class SteadyWind final : public WindSource {
 public:
  SteadyWind(const Eigen::Vector3d& at_reference_ned_mps, const Shear& shear)
      : at_reference_ned_mps_(at_reference_ned_mps), shear_(shear) {}
  Result<Eigen::Vector3d> towards_ned_mps(const AirPlace& place) override;

 private:
  Eigen::Vector3d at_reference_ned_mps_;
  Shear shear_;
};

}  // namespace nadir::sim

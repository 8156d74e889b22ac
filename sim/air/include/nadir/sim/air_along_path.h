#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "nadir/sim/air_motion.h"
#include "nadir/sim/environment.h"
#include "nadir/sim/gust.h"
#include "nadir/sim/turbulence.h"
#include "nadir/sim/wind.h"

namespace nadir::sim {

/// What moves the air, all of it added up.
struct AirParts {
  std::vector<std::unique_ptr<WindSource>> sources;
  std::vector<Gust> gusts;
  std::optional<Turbulence> turbulence;
  std::function<double(const geodesy::Point<geodesy::frame::Ecef>&)> height_above_ground_m;
};

/// Where a vehicle is and how it moves against the ground.
struct PathPoint {
  geodesy::Point<geodesy::frame::Ecef> position{Eigen::Vector3d::Zero()};
  geodesy::Direction<geodesy::frame::Ecef> velocity{Eigen::Vector3d::Zero()};  // m/s
};

/// The air along one vehicle's flight, in samples 10 ms apart with even change between them, however long the steps of
/// the motion are: it follows from the flight up to the last sample, and the next one is made for where the vehicle
/// will be at its velocity (an acceleration of 1 g makes 0.5 mm of that).
///
/// Gusts and turbulence are carried past at the speed through the wind of the sources, at least 1 m/s: a vehicle that
/// hovers in still air would meet one place of a frozen field for ever. Both follow the level direction of the way
/// through the air; what a gust is made of keeps the direction that it began with.
class AirAlongPath {
 public:
  static constexpr std::int64_t period_ns = 10'000'000;

  /// The air at time 0. `heading_ned`: the way through the air at the start, level, unit; `airspeed_mps` likewise.
  static Result<AirAlongPath> start(AirParts parts, const geodesy::Point<geodesy::frame::Ecef>& place,
                                    const Eigen::Vector3d& heading_ned, double airspeed_mps);

  /// The sample that follows: to be called with the vehicle's state at time 0, 10 ms, 20 ms, ...
  Result<void> advance(const Environment& environment, const PathPoint& now);

  /// Between the last two samples.
  const AirOverTime& air() const { return air_; }

 private:
  explicit AirAlongPath(AirParts parts) : parts_(std::move(parts)) {}

  /// A gust that has begun.
  struct Met {
    std::size_t gust = 0;
    double begins_m = 0;              // distance flown through the air by then
    Eigen::Vector3d towards_ned_mps;  // of unit speed
  };

  Result<Eigen::Vector3d> of_sources(double time_s, const geodesy::Point<geodesy::frame::Ecef>& place);
  AirMotion turned(const TurbulenceSample& sample) const;
  Passage passage(double speed_mps, const geodesy::Point<geodesy::frame::Ecef>& place) const;

  AirParts parts_;
  std::int64_t samples_ = 0;      // made after the first
  Eigen::Vector3d wind_ned_mps_;  // of the sources, at the last sample
  Eigen::Vector3d heading_ned_;   // level, unit
  double flown_m_ = 0;            // through the air
  std::vector<Met> met_;
  AirOverTime air_;
};

}  // namespace nadir::sim

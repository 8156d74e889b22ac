#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "nadir/base/result.h"
#include "nadir/geodesy/attitude.h"
#include "nadir/geodesy/geodetic.h"
#include "nadir/sim/flown_vehicle.h"
#include "nadir/sim/integrator.h"
#include "nadir/sim/scheduler.h"

namespace nadir::sim {

/// How a body moves against the Earth.
struct Twist {
  Eigen::Vector3d velocity_ecef_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d rates_radps = Eigen::Vector3d::Zero();  // body axes
};

/// A vehicle at one instant.
struct VehicleState {
  std::int64_t time_ns = 0;
  geodesy::Pose<geodesy::frame::Ecef, geodesy::frame::Body> ecef_from_body;
  geodesy::Geodetic place;
  geodesy::YawPitchRoll attitude;  // from north-east-down at its place
  Twist twist;
  std::optional<FlightData> flight;
};

/// How a flown vehicle's motion is stepped, and why so.
struct MotionPlan {
  Scheme scheme;
  std::string why;
};

/// Where a vehicle is: flown by a model, read from a file, told by another program.
class PoseSource {
 public:
  virtual ~PoseSource() = default;

  /// Adds what the source has to do as time passes.
  virtual void schedule(Scheduler& scheduler) = 0;

  /// The state now; asked while observing, at times that never fall.
  virtual Result<VehicleState> state_at(std::int64_t time_ns) const = 0;

  /// How a flown vehicle's motion is stepped.
  virtual const MotionPlan* motion_plan() const { return nullptr; }

  /// Names of what a flown vehicle has in FlightData::channels.
  virtual std::span<const std::string> channels() const { return {}; }

  /// What has happened to a flown vehicle, in the order of time.
  virtual std::span<const FlightEvent> events() const { return {}; }
};

/// Of a pose of the body in ECEF.
VehicleState vehicle_state(std::int64_t time_ns,
                           const geodesy::Pose<geodesy::frame::Ecef, geodesy::frame::Body>& ecef_from_body);

}  // namespace nadir::sim

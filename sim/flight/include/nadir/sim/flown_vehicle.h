#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/sim/air_motion.h"
#include "nadir/sim/flight_event.h"
#include "nadir/sim/rigid_body.h"
#include "nadir/sim/work.h"

namespace nadir::sim {

/// What a flown vehicle knows of itself beyond its pose.
struct FlightData {
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d rates_radps = Eigen::Vector3d::Zero();          // body axes, against inertial space
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();  // body axes: what accelerometers feel
  Eigen::Vector3d wind_ned_mps = Eigen::Vector3d::Zero();
  double airspeed_mps = 0, alpha_rad = 0, beta_rad = 0;
  double throttle = 0;            // commanded, [0, 1]; the mean of several motors
  double commanded_height_m = 0;  // above the tangent plane at the scene origin
  double off_path_right_m = 0, off_path_above_m = 0;
  std::vector<double> channels;  // what its kind has: surfaces, rotors, ...; named by FlownVehicle::channels()
};

/// A vehicle's body at one instant, and what goes with it.
struct FlightState {
  BodyState body;
  FlightData data;
};

/// A vehicle of some kind with its autopilot: decides each period, moves between. Whoever holds the clock calls
/// `decide` at the beginning of a period and `move` for the whole of it. One thread at a time.
class FlownVehicle {
 public:
  virtual ~FlownVehicle() = default;

  /// At the end of the last period moved over, or at the start.
  virtual const BodyState& body() const = 0;

  /// Controls for the period that begins at `time_ns`, in the air of that moment.
  virtual Result<void> decide(std::int64_t time_ns, const AirMotion& air) = 0;

  /// Over the period from `from_ns` to `to_ns`, with controls held. Fails where the motion diverges.
  virtual Result<void> move(std::int64_t from_ns, std::int64_t to_ns, const AirOverTime& air) = 0;

  /// At a time within the last period moved over, at its ends, or at the start.
  virtual Result<FlightState> at(std::int64_t time_ns, const AirOverTime& air) const = 0;

  /// Names of FlightData::channels, units included, as columns are named.
  virtual std::span<const std::string> channels() const = 0;

  /// What has happened so far, in the order of time. After one that ends the flight there is no more to fly: the state
  /// at the end of that period means nothing.
  virtual std::span<const FlightEvent> events() const { return {}; }

  /// What the motion has taken so far, without `at`.
  virtual const Work& work() const = 0;
};

}  // namespace nadir::sim

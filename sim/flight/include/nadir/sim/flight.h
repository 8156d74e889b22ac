#pragma once

#include <memory>
#include <vector>

#include "nadir/sim/air_along_path.h"
#include "nadir/sim/flown_vehicle.h"

namespace nadir::sim {

/// One vehicle, its autopilot and its air, period after period. Nothing else decides what happens: the same flight has
/// the same bits beside any other vehicles, and whoever looks at it, when and how often. One thread at a time.
class Flight {
 public:
  /// The autopilot decides, and the air is sampled, so often.
  static constexpr std::int64_t period_ns = AirAlongPath::period_ns;

  Flight(const Environment& environment, AirAlongPath air, std::unique_ptr<FlownVehicle> vehicle)
      : environment_(environment), air_(std::move(air)), vehicle_(std::move(vehicle)) {}

  /// The end of what has been flown.
  std::int64_t time_ns() const { return time_ns_; }

  /// At the beginning of a period, `time_ns()`: the air of the period and what the autopilot does in it.
  Result<void> decide();
  /// On to the beginning of the next. A motion that diverges is an event that ends the flight, and so is one that goes
  /// beyond any sense.
  Result<void> move();
  /// `decide` and `move` until `end_ns`, a multiple of the period.
  Result<void> fly(std::int64_t end_ns);

  /// At a time in the last period moved over, or now. What an autopilot has decided is in it from `decide` on. Fails
  /// after the event that ended the flight.
  Result<FlightState> at(std::int64_t time_ns) const;

  /// What has happened, in the order of time.
  const std::vector<FlightEvent>& events() const { return events_; }
  /// The event that ended the flight; none while it goes on. From then on `decide` and `move` fail with it.
  const FlightEvent* ended() const;

  const FlownVehicle& vehicle() const { return *vehicle_; }
  const Environment& environment() const { return environment_; }

 private:
  Environment environment_;
  AirAlongPath air_;
  std::unique_ptr<FlownVehicle> vehicle_;
  std::int64_t time_ns_ = 0;
  std::vector<FlightEvent> events_;
};

}  // namespace nadir::sim

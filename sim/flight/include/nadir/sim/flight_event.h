#pragma once

#include <cstdint>
#include <string>

#include "nadir/sim/air_motion.h"
#include "nadir/sim/environment.h"
#include "nadir/sim/rigid_body.h"

namespace nadir::sim {

/// Something that happened in a flight, for people and for records.
struct FlightEvent {
  std::string name;  // "crash", "diverged", "lift-off", "touch-down", "landed", ...: one for each kind of event
  std::int64_t time_ns = 0;
  std::string text;          // what happened, where, and how it moved
  bool ends_flight = false;  // there is nothing to fly after it
  static constexpr const char* diverged = "diverged";
  static constexpr const char* battery_empty = "battery empty";
};
/// Shorter hops off the ground are part of one touch-down.
inline constexpr std::int64_t hop_ns = 1'000'000'000;

/// "crash at 12.345 s: ..."
std::string in_words(const FlightEvent& event);

/// Place, airspeed, climb, attitude and rates in words. `body` is finite.
std::string in_words(const BodyState& body, const Environment& environment, const AirMotion& air);

/// Why no vehicle moves so: a component that is not finite, faster than 1000 m/s, turning by more than 100 rad/s, or
/// beyond 100 km of height. Empty where it may.
std::string beyond_sense(const BodyState& body);

}  // namespace nadir::sim

#include "nadir/sim/flight.h"

#include <fmt/format.h>

#include "nadir/base/time.h"

namespace nadir::sim {

Result<void> Flight::decide() {
  if (const FlightEvent* event = ended()) return fail(Error::Kind::Unsupported, in_words(*event));
  const BodyState& body = vehicle_->body();
  if (auto ok = air_.advance(environment_, {body.position, body.velocity}); !ok) return ok;
  return vehicle_->decide(time_ns_, air_.air().at(seconds_from_ns(time_ns_)));
}

Result<void> Flight::move() {
  if (const FlightEvent* event = ended()) return fail(Error::Kind::Unsupported, in_words(*event));
  const BodyState before = vehicle_->body();
  const auto moved = vehicle_->move(time_ns_, time_ns_ + period_ns, air_.air());
  const auto happened = vehicle_->events();
  events_.insert(events_.end(), happened.begin() + static_cast<std::ptrdiff_t>(events_.size()), happened.end());
  if (ended()) {
    time_ns_ += period_ns;
    return {};
  }
  const std::string why = moved ? beyond_sense(vehicle_->body()) : moved.error().message;
  if (!why.empty()) {
    const AirMotion air = air_.air().at(seconds_from_ns(time_ns_));
    events_.push_back(
        {FlightEvent::diverged, time_ns_,
         fmt::format("{}, {} ms after it was {}", why, period_ns / 1'000'000, in_words(before, environment_, air)),
         true});
  }
  if (moved) time_ns_ += period_ns;
  return {};
}

Result<void> Flight::fly(std::int64_t end_ns) {
  while (time_ns_ < end_ns) {
    if (auto ok = decide(); !ok) return ok;
    if (auto ok = move(); !ok) return ok;
  }
  return {};
}

Result<FlightState> Flight::at(std::int64_t time_ns) const {
  if (const FlightEvent* event = ended(); event && time_ns > event->time_ns)
    return fail(Error::Kind::Unsupported, in_words(*event));
  return vehicle_->at(time_ns, air_.air());
}

const FlightEvent* Flight::ended() const {
  return !events_.empty() && events_.back().ends_flight ? &events_.back() : nullptr;
}

}  // namespace nadir::sim

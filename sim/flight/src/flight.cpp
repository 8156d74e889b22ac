#include "nadir/sim/flight.h"

namespace nadir::sim {

Result<void> Flight::decide() {
  const BodyState& body = vehicle_->body();
  if (auto ok = air_.advance(environment_, {body.position, body.velocity}); !ok) return ok;
  return vehicle_->decide(time_ns_, air_.air().at(static_cast<double>(time_ns_) * 1e-9));
}

Result<void> Flight::move() {
  if (auto ok = vehicle_->move(time_ns_, time_ns_ + period_ns, air_.air()); !ok) return ok;
  time_ns_ += period_ns;
  return {};
}

Result<void> Flight::fly(std::int64_t end_ns) {
  while (time_ns_ < end_ns) {
    if (auto ok = decide(); !ok) return ok;
    if (auto ok = move(); !ok) return ok;
  }
  return {};
}

}  // namespace nadir::sim

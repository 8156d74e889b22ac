#include "nadir/sim/flown_fixed_wing.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "nadir/sim/trim.h"

namespace nadir::sim {
namespace {

double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

/// What adaptive steps may err, each: attitude by what it moves the ground by that a camera sees a kilometre away.
Tolerance<BodyVector> body_tolerance(double tolerance_m) {
  Tolerance<BodyVector> tolerance{BodyVector::Constant(tolerance_m), 0};
  tolerance.absolute.segment<4>(body_quaternion_at).setConstant(tolerance_m / 2000);  // half angles
  return tolerance;
}

class FlownFixedWing final : public FlownVehicle {
 public:
  FlownFixedWing(FixedWingFlight flight, const FeedForward& feed_forward, const FlightGains& gains)
      : flight_(std::move(flight)),
        state_(trimmed_state(feed_forward.level, flight_.environment, flight_.start, flight_.yaw_rad,
                             flight_.wind_ned_mps)),
        before_(state_),
        controls_(feed_forward.level.controls),
        gains_(gains),
        autopilot_(feed_forward, gains.autopilot),
        integrator_(flight_.scheme, to_vector(state_), body_tolerance(flight_.tolerance_m)) {}

  const BodyState& body() const override { return state_; }

  Result<void> decide(std::int64_t time_ns, const AirMotion& air) override {
    const Navigation now = true_navigation(state_, flight_.environment, air.velocity_ned_mps, flight_.scene);
    const MissionPiece& piece = flight_.mission.piece_at(now, static_cast<double>(time_ns) * 1e-9);
    guidance_ = follow(piece.path, now, gains_.path);
    guidance_.airspeed_mps = piece.airspeed_mps;
    off_path_ = path_error(piece.path, now);
    controls_ = autopilot_.step(guidance_, now, control_period_s);
    return {};
  }

  Result<void> move(std::int64_t from_ns, std::int64_t to_ns, const AirOverTime& air) override {
    auto next = moved(integrator_, state_, from_ns, to_ns, air);
    if (!next) return fail(next);
    before_ = state_;
    before_ns_ = from_ns;
    state_ = *next;
    state_ns_ = to_ns;
    return {};
  }

  Result<FlightState> at(std::int64_t time_ns, const AirOverTime& air) const override {
    assert(time_ns >= before_ns_ && time_ns <= state_ns_);
    FixedWingState now = state_;
    if (time_ns < state_ns_) {  // a way of its own from where the period began: not interpolated
      Scheme scheme = flight_.scheme;
      const double share = static_cast<double>(time_ns - before_ns_) / static_cast<double>(state_ns_ - before_ns_);
      scheme.steps = std::max(1, static_cast<int>(std::ceil(scheme.steps * share)));
      Integrator<BodyVector> integrator(scheme, to_vector(before_), body_tolerance(flight_.tolerance_m));
      auto within = moved(integrator, before_, before_ns_, time_ns, air);
      if (!within) return fail(within);
      now = *within;
    }
    const AirMotion moving = air.at(seconds(time_ns));
    const BodyInAir in_air = body_in_air(now, flight_.environment, moving);
    const Loads load = loads(flight_.vehicle, flight_.environment, now, controls_, moving);
    FlightState state{now, {}};
    FlightData& data = state.data;
    data.velocity_ned_mps = in_air.here.ecef_from_ned.transpose() * now.velocity.xyz;
    data.rates_radps = now.body_rates_radps;
    data.specific_force_mps2 = load.force_body_n / flight_.vehicle.mass.mass_kg();
    data.wind_ned_mps = moving.velocity_ned_mps;
    data.airspeed_mps = in_air.flow.airspeed_mps;
    data.alpha_rad = in_air.flow.alpha_rad;
    data.beta_rad = in_air.flow.beta_rad;
    data.throttle = controls_.throttle;
    data.commanded_height_m = guidance_.height_m;
    data.off_path_right_m = off_path_.right_m;
    data.off_path_above_m = off_path_.above_m;
    data.channels = {geodesy::to_degrees(now.surfaces.elevator_rad), geodesy::to_degrees(now.surfaces.aileron_rad),
                     geodesy::to_degrees(now.surfaces.rudder_rad)};
    return state;
  }

  std::span<const std::string> channels() const override {
    static const std::array<std::string, 3> names = {"elevator_deg", "aileron_deg", "rudder_deg"};
    return names;
  }

  const Work& work() const override { return integrator_.work(); }

 private:
  Result<FixedWingState> moved(Integrator<BodyVector>& integrator, const FixedWingState& from, std::int64_t from_ns,
                               std::int64_t to_ns, const AirOverTime& air) const {
    const double from_s = seconds(from_ns);
    const auto surfaces_at = [&](double time_s) {
      return surfaces_after(flight_.vehicle, from.surfaces, controls_.surfaces, time_s - from_s);
    };
    const auto change = [&](double time_s, const BodyVector& x) {
      return derivative(flight_.vehicle, flight_.environment, x, surfaces_at(time_s), controls_.throttle,
                        air.at(time_s));
    };
    BodyVector x = to_vector(from);
    if (auto ok = integrator.advance(change, from_s, seconds(to_ns), x); !ok) return fail(ok);
    renormalise_quaternion(x, body_quaternion_at);
    return FixedWingState{body_state_from_vector(x), surfaces_at(seconds(to_ns))};
  }

  FixedWingFlight flight_;
  FixedWingState state_, before_;  // at the end and at the beginning of the last period
  std::int64_t state_ns_ = 0, before_ns_ = 0;
  Controls controls_;
  Guidance guidance_;
  PathError off_path_;
  FlightGains gains_;
  Autopilot autopilot_;
  Integrator<BodyVector> integrator_;
};

}  // namespace

Result<std::unique_ptr<FlownVehicle>> fly_fixed_wing(FixedWingFlight flight) {
  const Surroundings here = flight.environment.at(geodesy::ecef_from_geodetic(flight.start));
  const double density = here.density_kgpm3, gravity = here.gravity_ecef_mps2.norm();
  const auto forward = feed_forward(flight.vehicle, flight.airspeed_mps, density, gravity);
  if (!forward) return fail(forward);
  FlightGains gains = designed_gains(flight.vehicle, forward->level, density, gravity);
  if (flight.change_gains) flight.change_gains(gains);
  if (!flight.fly_unstable)
    if (auto ok = check_stable(closed_loop_modes(flight.vehicle, *forward, gains, density, gravity)); !ok)
      return fail(ok);
  return std::make_unique<FlownFixedWing>(std::move(flight), *forward, gains);
}

}  // namespace nadir::sim

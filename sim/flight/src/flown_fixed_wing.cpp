#include "nadir/sim/flown_fixed_wing.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "flown_parts.h"
#include "nadir/sim/flight.h"
#include "nadir/sim/trim.h"

namespace nadir::sim {
namespace {

/// Steady flight at an airspeed, and the gains around it.
struct Approach {
  FeedForward forward;
  FlightGains gains;
};

class FlownFixedWing final : public FlownVehicle {
 public:
  FlownFixedWing(FixedWingFlight flight, const FeedForward& cruise, const FlightGains& gains,
                 const std::optional<Approach>& approach)
      : flight_(std::move(flight)),
        controls_(cruise.level.controls),
        gains_(gains),
        autopilot_(cruise, gains.autopilot),
        channels_{"elevator_deg", "aileron_deg", "rudder_deg"} {
    state_.wing =
        trimmed_state(cruise.level, flight_.environment, flight_.start, flight_.yaw_rad, flight_.wind_ned_mps);
    if (flight_.ground) {
      const FixedWingGroundSetup& setup = *flight_.ground;
      ground_ = ground_for(flight_.vehicle, setup.ground, flight_.environment);
      standing_m_ = standing_height_m(ground_->gear());
      if (standing_m_ > 0)
        for (const char* name : {"wheels_on_ground", "ground_force_n", "steering_deg", "brake"})
          channels_.push_back(name);
      const GroundRollGains roll = ground_roll_gains(ground_->gear());
      if (setup.takeoff) takeoff_.emplace(*setup.takeoff, gains.autopilot, roll);
      if (setup.landing) landing_.emplace(*setup.landing, approach->forward, approach->gains.autopilot, roll);
      start_low(setup);
    }
    before_ = state_;
    const BodyVector like = to_vector(state_.wing);
    integrator_.emplace(flight_.scheme, like, motion_tolerance(like, flight_.tolerance_m));
  }

  const BodyState& body() const override { return state_.wing; }
  bool takes_off() const { return takeoff_ && !takeoff_->done(); }

  Result<void> decide(std::int64_t time_ns, const AirMotion& air) override {
    const Navigation now = true_navigation(state_.wing, flight_.environment, air.velocity_ned_mps, flight_.scene);
    off_path_ = {};
    const bool low = takes_off();
    if (low || (landing_ && flight_.mission.finished())) {
      const GroundSense sense{ground_->ground().under(state_.wing.position).height_m - standing_m_,
                              state_.contact.touching != 0};
      const PilotCommand command = low ? take_off(now, sense, time_ns, air) : land(now, sense, time_ns, air);
      controls_ = command.controls;
      gear_ = command.gear;
      return {};
    }
    const MissionPiece& piece = flight_.mission.piece_at(now, seconds_from_ns(time_ns));
    guidance_ = follow(piece.path, now, gains_.path);
    guidance_.airspeed_mps = piece.airspeed_mps;
    off_path_ = path_error(piece.path, now);
    controls_ = autopilot_.step(guidance_, now, control_period_s);
    gear_ = {};
    return {};
  }

  Result<void> move(std::int64_t from_ns, std::int64_t to_ns, const AirOverTime& air) override {
    auto next = moved(*integrator_, state_, from_ns, to_ns, air, &ground_work_);
    if (!next) return fail(next);
    before_ = state_;
    before_ns_ = from_ns;
    state_ = next->state;
    state_ns_ = to_ns;
    work_ = integrator_->work();
    work_ += ground_work_.contact;
    if (flight_.ground) note(next->report, air);
    return {};
  }

  Result<FlightState> at(std::int64_t time_ns, const AirOverTime& air) const override {
    const auto here = state_at(time_ns, air);
    if (!here) return fail(here);
    const FixedWingState& now = here->wing;
    const GroundTouch touch = ground_ ? ground_->touch(to_vector(now), here->contact, gear_) : GroundTouch{};
    const AirMotion moving = air.at(seconds_from_ns(time_ns));
    const BodyInAir in_air = body_in_air(now, flight_.environment, moving);
    const Loads load =
        loads(flight_.vehicle, flight_.environment, now, controls_, moving, touch.height_m) + touch.loads;
    FlightState state{now, data_of(now, in_air, moving)};
    FlightData& data = state.data;
    data.specific_force_mps2 = load.force_body_n / flight_.vehicle.mass.mass_kg();
    data.throttle = controls_.throttle;
    data.commanded_height_m = guidance_.height_m;
    data.off_path_right_m = off_path_.right_m;
    data.off_path_above_m = off_path_.above_m;
    data.channels = {geodesy::to_degrees(now.surfaces.elevator_rad), geodesy::to_degrees(now.surfaces.aileron_rad),
                     geodesy::to_degrees(now.surfaces.rudder_rad)};
    if (standing_m_ > 0)
      data.channels.insert(data.channels.end(), {static_cast<double>(std::popcount(touch.touching)), touch.normal_n,
                                                 geodesy::to_degrees(gear_.steering_rad), gear_.brake});
    return state;
  }

  std::span<const std::string> channels() const override { return channels_; }
  std::span<const FlightEvent> events() const override { return events_; }
  const Work& work() const override { return work_; }

 private:
  struct State {
    FixedWingState wing;
    ContactState contact;
  };
  struct Moved {
    State state;
    ContactReport report;
  };

  /// Where a flight begins that does not begin in trim.
  void start_low(const FixedWingGroundSetup& setup) {
    FixedWingState& wing = state_.wing;
    if (setup.standing) {
      wing = standing_state(flight_.environment, ground_->gear(), *setup.ground, flight_.start, flight_.yaw_rad);
      controls_ = {};
      airborne_ = false;
    } else if (setup.launch_mps > 0) {
      const Surroundings here = flight_.environment.at(wing.position);
      wing.ecef_from_body.quaternion = (Eigen::Quaterniond(here.ecef_from_ned) *
                                        geodesy::quaternion_from({flight_.yaw_rad, setup.launch_pitch_rad, 0}))
                                           .normalized();
      wing.velocity.xyz = wing.ecef_from_body.quaternion * Eigen::Vector3d(setup.launch_mps, 0, 0) +
                          here.ecef_from_ned * flight_.wind_ned_mps;
    }
  }

  PilotCommand take_off(const Navigation& now, const GroundSense& sense, std::int64_t time_ns, const AirMotion& air) {
    const Takeoff::Phase before = takeoff_->phase();
    const PilotCommand command = takeoff_->step(autopilot_, now, sense, control_period_s);
    guidance_.height_m = now.height_m;
    if (before == Takeoff::Phase::Rotate && takeoff_->phase() == Takeoff::Phase::ClimbOut)
      tell("lift-off", time_ns, in_words(state_.wing, flight_.environment, air));
    return command;
  }

  PilotCommand land(const Navigation& now, const GroundSense& sense, std::int64_t time_ns, const AirMotion& air) {
    const Landing::Phase before = landing_->phase();
    const PilotCommand command = landing_->step(now, sense, control_period_s);
    guidance_.height_m = now.height_m;
    if (landing_->phase() == Landing::Phase::Glide) {
      off_path_ = landing_->off_glide(now);
      guidance_.height_m -= off_path_.above_m;
    }
    if (before != landing_->phase() && landing_->phase() == Landing::Phase::Stopped) {
      const Runway& runway = flight_.ground->landing->runway;
      tell("landed", time_ns,
           fmt::format("it stands {:.1f} m past the touch-down point and {:.1f} m to the right of its line, {}",
                       runway.past_m(now), runway.right_m(now), in_words(state_.wing, flight_.environment, air)));
    }
    return command;
  }

  void tell(const char* name, std::int64_t time_ns, std::string text, bool ends = false) {
    if (events_.empty() || !events_.back().ends_flight) events_.push_back({name, time_ns, std::move(text), ends});
  }

  /// What the last period's contact means.
  void note(const ContactReport& report, const AirOverTime& air) {
    const AirframeLimits& limits = flight_.ground->limits;
    const auto crash = [&](std::int64_t time_ns, const std::string& why) {
      // The period was flown to its end, so its parts can be
      if (const auto then = state_at(time_ns, air))
        tell("crash", time_ns, why + ", " + in_words(then->wing, flight_.environment, air.at(seconds_from_ns(time_ns))),
             true);
    };
    if (report.met) {
      const double roll_rad =
          true_navigation(state_.wing, flight_.environment, {0, 0, 0}, flight_.scene).attitude.roll_rad;
      if (report.impact_mps > limits.sink_mps)
        crash(state_ns_, fmt::format("a touch-down at {:.2f} m/s, where {:.2f} are all that it stands",
                                     report.impact_mps, limits.sink_mps));
      if (airborne_ && std::abs(roll_rad) > limits.bank_rad)
        crash(state_ns_, fmt::format("a touch-down at {:.1f} deg of bank, where {:.1f} are all that it stands",
                                     geodesy::to_degrees(std::abs(roll_rad)), geodesy::to_degrees(limits.bank_rad)));
      if (airborne_ && !report.part && !report.broken)
        tell("touch-down", state_ns_,
             fmt::format("at {:.2f} m/s, {}", report.impact_mps,
                         in_words(state_.wing, flight_.environment, air.at(seconds_from_ns(state_ns_)))));
    }
    if (const auto first = crash_of(report, ground_->gear(), before_ns_, state_ns_)) crash(first->time_ns, first->what);
    if (state_.contact.touching || report.met) {
      touched_ns_ = state_ns_;
      airborne_ = false;
    } else if (state_ns_ - touched_ns_ > hop_ns) {
      airborne_ = true;
    }

    if (std::isfinite(limits.load_factor)) {
      const Eigen::Vector3d felt =
          (state_.wing.velocity.xyz - before_.wing.velocity.xyz) / seconds_from_ns(state_ns_ - before_ns_) -
          flight_.environment.at(state_.wing.position).gravity_ecef_mps2;
      if (felt.norm() > limits.load_factor * 9.81)
        crash(state_ns_, fmt::format("the airframe breaks under {:.1f} g, where {:.1f} are all that it stands",
                                     felt.norm() / 9.81, limits.load_factor));
    }
  }

  Result<State> state_at(std::int64_t time_ns, const AirOverTime& air) const {
    assert(time_ns >= before_ns_ && time_ns <= state_ns_);
    if (time_ns == state_ns_) return state_;
    // A way of its own from where the period began: not interpolated
    const BodyVector like = to_vector(before_.wing);
    Integrator<BodyVector> integrator(scheme_of_part(flight_.scheme, time_ns - before_ns_, state_ns_ - before_ns_),
                                      like, motion_tolerance(like, flight_.tolerance_m));
    auto within = moved(integrator, before_, before_ns_, time_ns, air, nullptr);
    if (!within) return fail(within);
    return within->state;
  }

  Result<Moved> moved(Integrator<BodyVector>& integrator, const State& from, std::int64_t from_ns, std::int64_t to_ns,
                      const AirOverTime& air, ContactWork* ground_work) const {
    if (from_ns == to_ns) return Moved{from, {}};
    const double from_s = seconds_from_ns(from_ns), to_s = seconds_from_ns(to_ns);
    double surfaces_s = from_s;  // the stages of steps come in pairs of one time
    Surfaces surfaces = from.wing.surfaces;
    const auto surfaces_at = [&](double time_s) -> const Surfaces& {
      if (time_s != surfaces_s)
        surfaces = surfaces_after(flight_.vehicle, from.wing.surfaces, controls_.surfaces, time_s - from_s);
      surfaces_s = time_s;
      return surfaces;
    };
    const auto motion = [&](double time_s, const BodyVector& x, const Loads& of_ground, double height_m) {
      return derivative(flight_.vehicle, flight_.environment, x, surfaces_at(time_s), controls_.throttle,
                        air.at(time_s), of_ground, height_m);
    };
    const auto fly = flown_by(integrator);
    Moved to{from, {}};
    BodyVector x = to_vector(from.wing);
    if (ground_) {
      ContactWork work;
      auto report =
          ground_->advance(motion, fly, from_s, to_s, gear_, x, to.state.contact, ground_work ? *ground_work : work);
      if (!report) return fail(report);
      to.report = *report;
    } else {
      const auto alone = [&](double time_s, const BodyVector& at) { return motion(time_s, at, {}, no_ground_m); };
      if (auto ok = fly(alone, from_s, to_s, x); !ok) return fail(ok);
    }
    to.state.wing = {body_state_from_vector(x), surfaces_at(to_s)};
    return to;
  }

  FixedWingFlight flight_;
  std::optional<FixedWingGround> ground_;
  double standing_m_ = 0;  // of the centre of mass above ground, springs unloaded; 0: has no gear
  State state_, before_;   // at the end and at the beginning of the last period
  std::int64_t state_ns_ = 0, before_ns_ = 0;
  Controls controls_;
  GearCommand gear_;
  Guidance guidance_;
  PathError off_path_;
  FlightGains gains_;
  Autopilot autopilot_;
  std::optional<Takeoff> takeoff_;
  std::optional<Landing> landing_;
  std::optional<Integrator<BodyVector>> integrator_;  // there is one
  ContactWork ground_work_;
  Work work_;
  std::vector<std::string> channels_;
  std::vector<FlightEvent> events_;
  bool airborne_ = true;
  std::int64_t touched_ns_ = 0;
};

Result<std::unique_ptr<FlownFixedWing>> made(FixedWingFlight flight) {
  const Surroundings here = flight.environment.at(geodesy::ecef_from_geodetic(flight.start));
  const double density = here.density_kgpm3, gravity = here.gravity_ecef_mps2.norm();
  const auto forward_and_gains = [&](double airspeed_mps) -> Result<Approach> {
    auto forward = feed_forward(flight.vehicle, airspeed_mps, density, gravity);
    if (!forward) return fail(forward);
    Approach made{*forward, designed_gains(flight.vehicle, forward->level, density, gravity)};
    if (flight.change_gains) flight.change_gains(made.gains);
    if (!flight.fly_unstable)
      if (auto ok = check_stable(closed_loop_modes(flight.vehicle, made.forward, made.gains, density, gravity)); !ok)
        return fail(ok);
    return made;
  };
  const auto cruise = forward_and_gains(flight.airspeed_mps);
  if (!cruise) return fail(cruise);
  std::optional<Approach> approach;
  if (flight.ground && flight.ground->landing) {
    const auto found = forward_and_gains(flight.ground->landing->airspeed_mps);
    if (!found) return fail(found.error().kind, "land: " + found.error().message);
    approach = *found;
  }
  return std::make_unique<FlownFixedWing>(std::move(flight), cruise->forward, cruise->gains, approach);
}

}  // namespace

Result<std::unique_ptr<FlownVehicle>> fly_fixed_wing(FixedWingFlight flight) { return made(std::move(flight)); }

Result<Waypoint> climb_out_end(FixedWingFlight flight, AirAlongPath air) {
  assert(flight.ground && flight.ground->takeoff);
  constexpr std::int64_t longest_ns = 180'000'000'000;
  const double clear_m = flight.ground->takeoff->clear_m;
  const geodesy::LocalFrame scene = flight.scene;
  const Environment environment = flight.environment;
  auto vehicle = made(std::move(flight));
  if (!vehicle) return fail(vehicle);
  const FlownFixedWing& flown = **vehicle;
  Flight climb(environment, std::move(air), std::move(*vehicle));
  while (flown.takes_off()) {
    if (climb.time_ns() >= longest_ns)
      return fail(Error::Kind::Unsupported,
                  fmt::format("takeoff: it has not {} after {:g} s: its motor is too weak for it, or rotate_mps, "
                              "climb_mps or clear_m too high",
                              climb.events().empty() ? "lifted off" : fmt::format("climbed to {:g} m", clear_m),
                              seconds_from_ns(longest_ns)));
    if (auto ok = climb.fly(climb.time_ns() + Flight::period_ns); !ok) return fail(ok);
    if (const FlightEvent* end = climb.ended()) return fail(Error::Kind::Unsupported, "takeoff: " + in_words(*end));
  }
  const Navigation end = true_navigation(flown.body(), environment, Eigen::Vector3d::Zero(), scene);
  return Waypoint{end.north_m, end.east_m, end.height_m, end.course_rad, {}, {}};
}

}  // namespace nadir::sim

#include "nadir/sim/flown_multirotor.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <optional>

#include "flown_parts.h"
#include "nadir/sim/multirotor_ground.h"
#include "nadir/sim/multirotor_motion.h"
#include "nadir/sim/multirotor_trim.h"

namespace nadir::sim {
namespace {

using Eigen::Vector3d;

MultirotorVector vector_of(const Multirotor& vehicle, const MultirotorState& state, CurrentModel currents,
                           const MultirotorVector*) {
  return to_vector(vehicle, state, currents);
}
BodyVector vector_of(const Multirotor&, const MultirotorState& state, CurrentModel, const BodyVector*) {
  return to_vector(static_cast<const BodyState&>(state));
}

std::vector<std::string> channel_names(const Multirotor& vehicle, bool over_ground) {
  std::vector<std::string> names;
  if (vehicle.lumped) names = {"thrust_share", "roll_share", "pitch_share", "yaw_share"};
  for (std::size_t i = 1; i <= vehicle.rotors.size(); ++i) {
    names.push_back(fmt::format("rotor{}_throttle", i));
    names.push_back(fmt::format("rotor{}_thrust_n", i));
    if (std::holds_alternative<ElectricDrive>(vehicle.rotors[i - 1].drive))
      names.push_back(fmt::format("rotor{}_rate_radps", i));
  }
  if (vehicle.battery)
    for (const char* name : {"battery_v", "battery_a", "battery_share"}) names.push_back(name);
  if (over_ground)
    for (const char* name : {"legs_on_ground", "ground_force_n"}) names.push_back(name);
  names.push_back("waypoint");
  return names;
}

/// `Vector`: BodyVector where nothing but the body is integrated, else MultirotorVector.
template <class Vector>
class FlownMultirotor final : public FlownVehicle {
 public:
  FlownMultirotor(MultirotorFlight flight, MultirotorControl control, MultirotorPilot pilot, MultirotorState state,
                  const MultirotorControls& controls, bool standing)
      : flight_(std::move(flight)),
        channels_(channel_names(flight_.vehicle, flight_.ground != nullptr)),
        currents_(flight_.integrate_currents && state.current_a.size() > 0 ? CurrentModel::Integrated
                                                                           : CurrentModel::Settled),
        control_(std::move(control)),
        pilot_(std::move(pilot)),
        state_{std::move(state), {}, standing},
        before_(state_),
        controls_(controls),
        integrator_(flight_.scheme, vector(state_.vehicle),
                    motion_tolerance(vector(state_.vehicle), flight_.tolerance_m)) {
    control_.reset(state_.vehicle, now(AirMotion(flight_.wind_ned_mps)));
    if (flight_.ground)
      ground_ = ground_for(flight_.vehicle, flight_.ground, flight_.environment, vector(state_.vehicle));
  }

  const BodyState& body() const override { return state_.vehicle; }

  Result<void> decide(std::int64_t time_ns, const AirMotion& air) override {
    const Navigation here = now(air);
    setpoint_ = pilot_.setpoint(seconds_from_ns(time_ns), control_period_s, state_.standing);
    if (pilot_.rotors_off()) {
      controls_.actuators.setZero();
      return {};
    }
    if (state_.standing) control_.reset(state_.vehicle, here);
    controls_ = control_.step(setpoint_, here, control_period_s, supply_v(air));
    return {};
  }

  Result<void> move(std::int64_t from_ns, std::int64_t to_ns, const AirOverTime& air) override {
    auto next = moved(integrator_, state_, from_ns, to_ns, air, ground_work_);
    if (!next) return fail(next);
    before_ = state_;
    before_ns_ = from_ns;
    state_ = std::move(next->stance);
    state_ns_ = to_ns;
    work_ = integrator_.work();
    work_ += ground_work_.contact;
    note_events(next->report, air);
    return {};
  }

  Result<FlightState> at(std::int64_t time_ns, const AirOverTime& air) const override {
    const auto stance = stance_at(time_ns, air);
    if (!stance) return fail(stance);
    const MultirotorState& now = stance->vehicle;
    const GroundTouch touch = ground_ ? ground_->touch(vector(now), stance->contact, {}) : GroundTouch{};
    const AirMotion moving = air.at(seconds_from_ns(time_ns));
    const BodyInAir in_air = body_in_air(now, flight_.environment, moving);
    const MultirotorOutput out = output(flight_.vehicle, in_air, now, controls_, touch.height_m, currents_);
    FlightState state{now, data_of(now, in_air, moving)};
    FlightData& data = state.data;
    data.specific_force_mps2 = (out.loads + touch.loads).force_body_n / flight_.vehicle.mass.mass_kg();
    data.throttle = flight_.vehicle.lumped ? controls_.actuators[0] : controls_.actuators.mean();
    data.commanded_height_m = -setpoint_.position_ned_m.z();
    note_off_path(now, data);
    note_channels(now, out, touch, data.channels);
    return state;
  }

  std::span<const std::string> channels() const override { return channels_; }
  std::span<const FlightEvent> events() const override { return events_; }
  const Work& work() const override { return work_; }

 private:
  /// A state, and how it stands to the ground.
  struct Stance {
    MultirotorState vehicle;
    ContactState contact;
    bool standing = false;  // touches it, or did within the period
  };
  struct Moved {
    Stance stance;
    ContactReport report;
  };

  /// What the last period brought.
  void note_events(const ContactReport& report, const AirOverTime& air) {
    const auto words = [&](const Stance& then, std::int64_t time_ns) {
      return in_words(then.vehicle, flight_.environment, air.at(seconds_from_ns(time_ns)));
    };
    const bool empty = flight_.vehicle.battery && state_.vehicle.charge_ah <= 0;
    if (empty && before_.vehicle.charge_ah > 0)
      events_.push_back({FlightEvent::battery_empty, state_ns_, words(state_, state_ns_)});

    if (ground_)
      if (const auto crash = crash_of(report, ground_->gear(), before_ns_, state_ns_)) {
        // The period was flown to its end, so its parts can be
        if (const auto then = stance_at(crash->time_ns, air))
          events_.push_back(
              {"crash", crash->time_ns,
               fmt::format("{}{}, {}", crash->what, empty ? ", its battery empty" : "", words(*then, crash->time_ns)),
               true});
        return;
      }
    if (before_.standing && !state_.standing) leaves_ = FlightEvent{"lift-off", state_ns_, words(state_, state_ns_)};
    if (state_.standing) {
      if (!before_.standing && !leaves_)
        events_.push_back(
            {"touch-down", state_ns_, fmt::format("at {:.2f} m/s, {}", report.impact_mps, words(state_, state_ns_))});
      leaves_.reset();
    } else if (leaves_ && state_ns_ - leaves_->time_ns >= hop_ns) {
      events_.push_back(*leaves_);
      leaves_.reset();
    }
  }

  Vector vector(const MultirotorState& state) const {
    return vector_of(flight_.vehicle, state, currents_, static_cast<const Vector*>(nullptr));
  }
  Navigation now(const AirMotion& air) const {
    return true_navigation(state_.vehicle, flight_.environment, air.velocity_ned_mps, flight_.scene);
  }
  double supply_v(const AirMotion& air) const {
    if (!flight_.vehicle.battery) return 0;
    return output(flight_.vehicle, body_in_air(state_.vehicle, flight_.environment, air), state_.vehicle, controls_,
                  no_ground_m, currents_)
        .supply_v;
  }

  Result<Stance> stance_at(std::int64_t time_ns, const AirOverTime& air) const {
    assert(time_ns >= before_ns_ && time_ns <= state_ns_);
    if (time_ns == state_ns_) return state_;
    // A way of its own from where the period began: not interpolated
    const Vector like = vector(before_.vehicle);
    Integrator<Vector> integrator(scheme_of_part(flight_.scheme, time_ns - before_ns_, state_ns_ - before_ns_), like,
                                  motion_tolerance(like, flight_.tolerance_m));
    ContactWork work;
    auto within = moved(integrator, before_, before_ns_, time_ns, air, work);
    if (!within) return fail(within);
    return std::move(within->stance);
  }

  Result<Moved> moved(Integrator<Vector>& integrator, const Stance& from, std::int64_t from_ns, std::int64_t to_ns,
                      const AirOverTime& air, ContactWork& ground_work) const {
    if (from_ns == to_ns) return Moved{from, {}};
    const double from_s = seconds_from_ns(from_ns), to_s = seconds_from_ns(to_ns);
    const MultirotorMotion motion(flight_.vehicle, flight_.environment, from.vehicle, controls_, air, from_s,
                                  currents_);
    const auto fly = flown_by(integrator);
    Moved to{{{}, from.contact}, {}};
    Vector x = vector(from.vehicle);
    if (ground_) {
      auto report =
          ground_->advance(over_ground<Vector>(motion), fly, from_s, to_s, {}, x, to.stance.contact, ground_work);
      if (!report) return fail(report);
      to.report = std::move(*report);
    } else if (auto ok = fly(motion, from_s, to_s, x); !ok) {
      return fail(ok);
    }
    to.stance.vehicle = motion.state_at(to_s, x);
    to.stance.standing = to.stance.contact.touching != 0 || to.report.met != 0;
    return to;
  }

  /// Seen along the way that is asked for, or along the yaw where it is to stand still.
  void note_off_path(const BodyState& body, FlightData& data) const {
    const Vector3d enu = (flight_.scene.enu_from_ecef() * body.position).xyz;
    const Vector3d off = Vector3d(enu.y(), enu.x(), -enu.z()) - setpoint_.position_ned_m;
    Eigen::Vector2d along = setpoint_.velocity_ned_mps.head<2>();
    if (along.norm() < 0.1) along = {std::cos(setpoint_.yaw_rad), std::sin(setpoint_.yaw_rad)};
    along.normalize();
    data.off_path_right_m = along.x() * off.y() - along.y() * off.x();
    data.off_path_above_m = -off.z();
  }

  void note_channels(const MultirotorState& state, const MultirotorOutput& out, const GroundTouch& touch,
                     std::vector<double>& values) const {
    for (Eigen::Index i = 0; i < controls_.actuators.size(); ++i) {
      values.push_back(controls_.actuators[i]);
      if (flight_.vehicle.lumped) continue;
      values.push_back(out.thrust_n[i]);
      if (std::holds_alternative<ElectricDrive>(flight_.vehicle.rotors[static_cast<std::size_t>(i)].drive))
        values.push_back(out.omega_radps[i]);
    }
    if (const auto& battery = flight_.vehicle.battery) {
      values.push_back(out.supply_v);
      values.push_back(out.supply_current_a);
      values.push_back(state.charge_ah / battery->capacity_ah);
    }
    if (ground_) {
      values.push_back(static_cast<double>(std::popcount(touch.touching)));
      values.push_back(touch.normal_n);
    }
    values.push_back(static_cast<double>(pilot_.waypoint() + 1));
  }

  MultirotorFlight flight_;
  std::vector<std::string> channels_;
  std::vector<FlightEvent> events_;
  std::optional<FlightEvent> leaves_;  // the ground, and is told if it does not come back at once
  CurrentModel currents_;
  MultirotorControl control_;
  MultirotorPilot pilot_;
  Stance state_, before_;  // at the end and at the beginning of the last period
  std::int64_t state_ns_ = 0, before_ns_ = 0;
  MultirotorControls controls_;
  MultirotorSetpoint setpoint_;
  Integrator<Vector> integrator_;
  std::optional<GroundContact<Vector>> ground_;
  ContactWork ground_work_;
  Work work_;
};

}  // namespace

Result<std::unique_ptr<FlownVehicle>> fly_multirotor(MultirotorFlight flight) {
  if (const auto faults = faults_of(flight.vehicle); !faults.empty())
    return fail(Error::Kind::Malformed, to_string(faults));
  if (flight.mission.from_ground && !flight.ground)
    return fail(Error::Kind::Malformed, "mission: it begins on the ground: expected a ground to stand on");
  const Waypoint& start = flight.mission.start;
  const geodesy::Geodetic place =
      geodesy::geodetic_from_ecef(flight.scene.ecef_from_enu() *
                                  geodesy::Point<geodesy::frame::Enu>{{start.east_m, start.north_m, start.height_m}});
  const Surroundings here = flight.environment.at(geodesy::ecef_from_geodetic(place));
  const double gravity = here.gravity_ecef_mps2.norm(), density = here.density_kgpm3;
  const double charge_ah = flight.vehicle.battery ? flight.charge_share * flight.vehicle.battery->capacity_ah : 0;

  auto gains = multirotor_gains(flight.vehicle, control_period_s, density, gravity);
  if (!gains) return fail(gains);
  // Faster than the mission by half, to catch up
  const TrajectoryLimits& asked = flight.mission.limits;
  gains->max_speed_mps = std::max(gains->max_speed_mps, 1.5 * asked.speed_mps);
  gains->max_climb_mps = std::max(gains->max_climb_mps, 1.5 * asked.climb_mps);
  gains->max_descent_mps = std::max(gains->max_descent_mps, 1.5 * asked.descent_mps);
  auto mixer = Mixer::create(flight.vehicle, density);
  if (!mixer) return fail(mixer);
  if (auto ok = check(*gains, *mixer, control_period_s, gravity); !ok) return fail(ok);
  auto pilot = MultirotorPilot::create(flight.mission, gains->max_yaw_rate_radps);
  if (!pilot) return fail(pilot);
  MultirotorControl control(flight.vehicle, std::move(*mixer), *gains, gravity);

  // Over the ground it is at rest: through the air it goes against the wind
  const double yaw = flight.mission.yaw_rad, c = std::cos(yaw), s = std::sin(yaw);
  const Vector3d air = flight.mission.from_ground ? Vector3d::Zero() : Vector3d(-flight.wind_ned_mps);
  const MultirotorTrimTarget target{c * air.x() + s * air.y(), -s * air.x() + c * air.y(), -air.z()};
  auto hover = trim(flight.vehicle, target, density, gravity, charge_ah);
  if (!hover) return fail(hover);
  const bool standing = flight.mission.from_ground;
  if (standing) {
    hover->roll_rad = hover->pitch_rad = 0;
    hover->controls.actuators.setZero();
  }
  MultirotorState state = trimmed_state(flight.vehicle, *hover, flight.environment, place, yaw,
                                        standing ? Vector3d::Zero() : flight.wind_ned_mps, charge_ah);
  if (standing)
    static_cast<BodyState&>(state) =
        standing_body(flight.environment, gear_of(flight.vehicle), *flight.ground, place, yaw);
  const MultirotorControls controls = hover->controls;
  const bool body_alone =
      vector_size(flight.vehicle, flight.integrate_currents ? CurrentModel::Integrated : CurrentModel::Settled) == 13;
  if (body_alone)
    return std::make_unique<FlownMultirotor<BodyVector>>(std::move(flight), std::move(control), std::move(*pilot),
                                                         std::move(state), controls, standing);
  return std::make_unique<FlownMultirotor<MultirotorVector>>(std::move(flight), std::move(control), std::move(*pilot),
                                                             std::move(state), controls, standing);
}

}  // namespace nadir::sim

#include "nadir/sim/flown_multirotor.h"
#include "nadir/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

#include "nadir/sim/multirotor_motion.h"
#include "nadir/sim/multirotor_trim.h"

namespace nadir::sim {
namespace {

using Eigen::Vector3d;

/// What adaptive steps may err, each: attitude by what it moves the ground by that a camera sees a kilometre away;
/// speeds of rotors by a thousandth of what they hover at, currents by as much.
template <class Vector>
Tolerance<Vector> tolerance_of(const Vector& like, double tolerance_m) {
  Tolerance<Vector> tolerance{like, 0};
  tolerance.absolute.setConstant(100 * tolerance_m);
  tolerance.absolute.template head<13>().setConstant(tolerance_m);
  tolerance.absolute.template segment<4>(body_quaternion_at).setConstant(tolerance_m / 2000);  // half angles
  return tolerance;
}

MultirotorVector vector_of(const Multirotor& vehicle, const MultirotorState& state, CurrentModel currents,
                           const MultirotorVector*) {
  return to_vector(vehicle, state, currents);
}
BodyVector vector_of(const Multirotor&, const MultirotorState& state, CurrentModel, const BodyVector*) {
  return to_vector(static_cast<const BodyState&>(state));
}

std::vector<std::string> channel_names(const Multirotor& vehicle) {
  if (vehicle.lumped) return {"thrust_share", "roll_share", "pitch_share", "yaw_share", "waypoint"};
  std::vector<std::string> names;
  for (std::size_t i = 1; i <= vehicle.rotors.size(); ++i) {
    names.push_back(fmt::format("rotor{}_throttle", i));
    names.push_back(fmt::format("rotor{}_thrust_n", i));
    if (std::holds_alternative<ElectricDrive>(vehicle.rotors[i - 1].drive))
      names.push_back(fmt::format("rotor{}_rate_radps", i));
  }
  if (vehicle.battery)
    for (const char* name : {"battery_v", "battery_a", "battery_share"}) names.push_back(name);
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
        channels_(channel_names(flight_.vehicle)),
        currents_(flight_.integrate_currents && state.current_a.size() > 0 ? CurrentModel::Integrated
                                                                           : CurrentModel::Settled),
        control_(std::move(control)),
        pilot_(std::move(pilot)),
        state_{std::move(state), standing},
        before_(state_),
        controls_(controls),
        integrator_(flight_.scheme, vector(state_.vehicle), tolerance_of(vector(state_.vehicle), flight_.tolerance_m)) {
    control_.reset(state_.vehicle, now(AirMotion(flight_.wind_ned_mps)));
  }

  const BodyState& body() const override { return state_.vehicle; }

  Result<void> decide(std::int64_t time_ns, const AirMotion& air) override {
    const Navigation here = now(air);
    ground_m_ = ground_below(state_.vehicle);
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
    auto next = moved(integrator_, state_, from_ns, to_ns, air);
    if (!next) return fail(next);
    before_ = state_;
    before_ns_ = from_ns;
    state_ = *next;
    state_ns_ = to_ns;
    note_events(air.at(seconds_from_ns(to_ns)));
    return {};
  }

  Result<FlightState> at(std::int64_t time_ns, const AirOverTime& air) const override {
    assert(time_ns >= before_ns_ && time_ns <= state_ns_);
    Stance then = state_;
    if (time_ns < state_ns_) {  // a way of its own from where the period began: not interpolated
      Scheme scheme = flight_.scheme;
      const double share = static_cast<double>(time_ns - before_ns_) / static_cast<double>(state_ns_ - before_ns_);
      scheme.steps = std::max(1, static_cast<int>(std::ceil(scheme.steps * share)));
      const Vector like = vector(before_.vehicle);
      Integrator<Vector> integrator(scheme, like, tolerance_of(like, flight_.tolerance_m));
      auto within = moved(integrator, before_, before_ns_, time_ns, air);
      if (!within) return fail(within);
      then = *within;
    }
    const AirMotion moving = air.at(seconds_from_ns(time_ns));
    const BodyInAir in_air = body_in_air(then.vehicle, flight_.environment, moving);
    const MultirotorOutput out = output(flight_.vehicle, in_air, then.vehicle, controls_, ground_m_, currents_);
    FlightState state{then.vehicle, {}};
    FlightData& data = state.data;
    const Eigen::Matrix3d ned_from_ecef = in_air.here.ecef_from_ned.transpose();
    data.velocity_ned_mps = ned_from_ecef * then.vehicle.velocity.xyz;
    data.rates_radps = then.vehicle.body_rates_radps;
    data.specific_force_mps2 = then.standing
                                   ? Vector3d(-(in_air.ecef_from_body.transpose() * in_air.here.gravity_ecef_mps2))
                                   : Vector3d(out.loads.force_body_n / flight_.vehicle.mass.mass_kg());
    data.wind_ned_mps = moving.velocity_ned_mps;
    data.airspeed_mps = in_air.flow.airspeed_mps;
    data.alpha_rad = in_air.flow.alpha_rad;
    data.beta_rad = in_air.flow.beta_rad;
    data.throttle = flight_.vehicle.lumped ? controls_.actuators[0] : controls_.actuators.mean();
    data.commanded_height_m = -setpoint_.position_ned_m.z();
    note_off_path(then.vehicle, data);
    note_channels(then.vehicle, out, data.channels);
    return state;
  }

  std::span<const std::string> channels() const override { return channels_; }
  std::span<const FlightEvent> events() const override { return events_; }
  const Work& work() const override { return integrator_.work(); }

 private:
  /// A state, and how it stands to the ground.
  struct Stance {
    MultirotorState vehicle;
    bool standing = false;
    std::string crash = {};  // a touch that it does not stand
    double touch_mps = 0;    // sink rate of the last touch
  };

  /// What the last period brought.
  void note_events(const AirMotion& air) {
    const auto words = [&] { return in_words(state_.vehicle, flight_.environment, air); };
    const auto tell = [&](const char* name, const std::string& how, bool ends = false) {
      events_.push_back({name, state_ns_, how + words(), ends});
    };
    if (flight_.vehicle.battery && state_.vehicle.charge_ah <= 0 && before_.vehicle.charge_ah > 0)
      tell("battery empty", "");
    if (!state_.crash.empty()) return tell("crash", state_.crash + ", ", true);
    if (before_.standing && !state_.standing) leaves_ = FlightEvent{"lift-off", state_ns_, words()};
    if (state_.standing) {
      if (!before_.standing && !leaves_) tell("touch-down", fmt::format("at {:.2f} m/s, ", state_.touch_mps));
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
  /// Height of the ground below as `Surroundings::height_m` counts.
  double ground_below(const BodyState& body) const {
    if (!flight_.ground.height_above_m) return far_below_m;
    return flight_.environment.at(body.position).height_m - flight_.ground.height_above_m(body.position);
  }
  double supply_v(const AirMotion& air) const {
    if (!flight_.vehicle.battery) return 0;
    return output(flight_.vehicle, body_in_air(state_.vehicle, flight_.environment, air), state_.vehicle, controls_,
                  ground_m_, currents_)
        .supply_v;
  }

  Result<Stance> moved(Integrator<Vector>& integrator, const Stance& from, std::int64_t from_ns, std::int64_t to_ns,
                       const AirOverTime& air) const {
    const double from_s = seconds_from_ns(from_ns), to_s = seconds_from_ns(to_ns);
    const MultirotorMotion motion(flight_.vehicle, flight_.environment, from.vehicle, controls_, air, from_s, ground_m_,
                                  currents_);
    Vector x = vector(from.vehicle);
    if (auto ok = integrator.advance(motion, from_s, to_s, x); !ok) return fail(ok);
    renormalise_quaternion(x, body_quaternion_at);
    return grounded(from, {motion.state_at(to_s, x)});
  }

  /// What the ground makes of a motion from one state to another.
  Stance grounded(const Stance& from, Stance to) const {
    const MultirotorGround& ground = flight_.ground;
    if (!ground.height_above_m) return to;
    const double height_m = ground.height_above_m(to.vehicle.position) - ground.legs_m;
    if (height_m > 0) return to;
    if (from.standing) {
      static_cast<BodyState&>(to.vehicle) = from.vehicle;
      to.standing = true;
      return to;
    }
    const Surroundings here = flight_.environment.at(to.vehicle.position);
    BodyState& body = to.vehicle;
    const Vector3d up = -here.ecef_from_ned.col(2);
    const double sink_mps = -body.velocity.xyz.dot(up);
    const double tilt_rad =
        std::acos(std::clamp(-(body.ecef_from_body.quaternion * Vector3d::UnitZ().eval()).dot(up), -1.0, 1.0));
    if (sink_mps > ground.most_touch_mps || tilt_rad > ground.most_touch_tilt_rad) {
      to.crash = fmt::format(
          "a touch-down at {:.2f} m/s and {:.0f} deg of tilt, where {:.1f} and {:.0f} are all that "
          "it stands{}",
          sink_mps, geodesy::to_degrees(tilt_rad), ground.most_touch_mps,
          geodesy::to_degrees(ground.most_touch_tilt_rad),
          flight_.vehicle.battery && to.vehicle.charge_ah <= 0 ? ", its battery empty" : "");
      return to;
    }
    to.standing = true;
    to.touch_mps = sink_mps;
    body.position.xyz -= height_m * up;
    body.velocity.xyz.setZero();
    body.body_rates_radps = body.ecef_from_body.quaternion.conjugate() * here.earth_rate_ecef_radps;
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

  void note_channels(const MultirotorState& state, const MultirotorOutput& out, std::vector<double>& values) const {
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
  double ground_m_ = far_below_m;
  MultirotorControls controls_;
  MultirotorSetpoint setpoint_;
  Integrator<Vector> integrator_;
};

}  // namespace

Result<std::unique_ptr<FlownVehicle>> fly_multirotor(MultirotorFlight flight) {
  if (const auto faults = faults_of(flight.vehicle); !faults.empty())
    return fail(Error::Kind::Malformed, to_string(faults));
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

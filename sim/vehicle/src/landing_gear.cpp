#include "nadir/sim/landing_gear.h"

#include "nadir/sim/step.h"

namespace nadir::sim {

FixedWingGround ground_for(const FixedWing& vehicle, std::shared_ptr<const Ground> ground,
                           const Environment& environment) {
  // Any place tells how the Earth turns
  const auto equator = geodesy::ecef_from_geodetic({});
  return {vehicle.gear.value_or(ContactGear()), std::move(ground), environment.at(equator).earth_rate_ecef_radps,
          ground_effect_spans * vehicle.span_m, FixedWingGround::usual_tolerance(BodyVector::Zero())};
}

Result<FixedWingStep> advance(const FixedWing& vehicle, const Environment& environment, const FixedWingGround& ground,
                              const FixedWingState& state, const ContactState& contact, const Controls& controls,
                              const GearCommand& gear, const AirOverTime& air, double t_s, double dt_s,
                              ContactWork& work) {
  const auto surfaces_at = [&](double time_s) {
    return surfaces_after(vehicle, state.surfaces, controls.surfaces, time_s - t_s);
  };
  const auto motion = [&](double time_s, const BodyVector& x, const Loads& of_ground, double height_m) {
    return derivative(vehicle, environment, x, surfaces_at(time_s), controls.throttle, air.at(time_s), of_ground,
                      height_m);
  };
  const auto fly = [](const auto& f, double from_s, double end_s, BodyVector& x) -> Result<void> {
    BodyVector next = rk4_step(f, from_s, x, end_s - from_s);
    renormalise_quaternion(next, body_quaternion_at);
    if (!next.allFinite()) return tl::unexpected(not_finite(next, end_s));
    x = next;
    return {};
  };
  FixedWingStep step{state, contact, {}};
  BodyVector x = to_vector(state);
  auto report = ground.advance(motion, fly, t_s, t_s + dt_s, gear, x, step.contact, work);
  if (!report) return fail(report);
  step.report = std::move(*report);
  step.state = {body_state_from_vector(x), surfaces_at(t_s + dt_s)};
  return step;
}

FixedWingState standing_state(const Environment& environment, const ContactGear& gear, const Ground& ground,
                              const geodesy::Geodetic& place, double yaw_rad) {
  return {standing_body(environment, gear, ground, place, yaw_rad), {}};
}

}  // namespace nadir::sim

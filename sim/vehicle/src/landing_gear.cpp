#include "nadir/sim/landing_gear.h"

#include "nadir/sim/step.h"

namespace nadir::sim {
using Eigen::Vector3d;

ContactGear aerosonde_gear() {
  using Kind = ContactPoint::Kind;
  const ContactPoint main{.name = "main wheel",
                          .kind = Kind::Wheel,
                          .stiffness_npm = 4000,
                          .damping_spm = 1.8,
                          .friction = 0.8,
                          .rolling_friction = 0.03,
                          .brake_friction = 0.4,
                          .most_n = 1000};
  ContactPoint left = main, right = main, nose = main;
  left.name = "left wheel", left.body_m = {-0.07, -0.35, 0.3};
  right.name = "right wheel", right.body_m = {-0.07, 0.35, 0.3};
  nose.name = "nose wheel", nose.body_m = {0.5, 0, 0.3};
  nose.stiffness_npm = 2500, nose.brake_friction = 0, nose.steering = 1, nose.most_n = 600;
  std::vector<ContactPoint> points{nose, left, right};
  const auto part = [&](const char* name, const Vector3d& at) {
    points.push_back({.name = name, .kind = Kind::Part, .body_m = at});
  };
  part("left wing tip", {0, -1.4478, -0.05});
  part("right wing tip", {0, 1.4478, -0.05});
  part("nose", {0.65, 0, 0.05});
  part("belly", {0, 0, 0.12});
  part("tail", {-1.1, 0, 0.06});
  return ContactGear::create(std::move(points)).value();
}

FixedWingGround ground_for(const FixedWing& vehicle, ContactGear gear, std::shared_ptr<const Ground> ground,
                           const Environment& environment) {
  // Any place tells how the Earth turns
  const auto equator = geodesy::ecef_from_geodetic({});
  return {std::move(gear), std::move(ground), environment.at(equator).earth_rate_ecef_radps,
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

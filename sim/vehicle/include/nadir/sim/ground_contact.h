#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "nadir/sim/contact.h"
#include "nadir/sim/ground.h"
#include "nadir/sim/integrator.h"

namespace nadir::sim {

/// What a vehicle remembers of the ground from one step to the next; a part of its state.
struct ContactState {
  Eigen::Vector3d clear_center_ecef = Eigen::Vector3d::Zero();
  double clear_m = 0;          // no ground is nearer to that place
  double step_s = 0;           // that the ground asked for last; 0: none
  std::uint32_t touching = 0;  // bit i: point i is in the ground
  bool resting = false;        // stands still, held by the loads below
  Loads held;
  GearCommand held_command;
};

/// What the ground did in one step.
struct ContactReport {
  std::uint32_t met = 0;  // bit i: point i came to the ground
  double impact_mps = 0;  // the fastest of them, along the normal
  int most_loaded = -1;   // point of the greatest force
  double most_n = 0;      // along the normal
  struct Crash {
    int point = 0;
    double time_s = 0;
  };
  std::optional<Crash> part;    // the first part that met the ground and must not
  std::optional<Crash> broken;  // the first wheel or skid under more force than it stands
};

/// What the ground has cost.
struct ContactWork {
  std::int64_t clear_steps = 0;    // without a look at the ground
  std::int64_t low_steps = 0;      // with a look, and no point that could come to it
  std::int64_t contact_steps = 0;  // integrated with contact
  std::int64_t resting_steps = 0;  // held where it is
  std::int64_t looks = 0;          // at the ground under one place
  Work contact;                    // of the implicit method
};

/// What the ground does to a vehicle at one moment.
struct GroundTouch {
  Loads loads;
  std::uint32_t touching = 0;                                 // bit i: point i is in the ground
  double normal_n = 0;                                        // all points' forces along the normal
  double height_m = std::numeric_limits<double>::infinity();  // of the centre of mass above ground, where that is low
};

namespace contact_parts {

/// Ground under each point, in coordinates from a place near the vehicle: ECEF itself has steps of a nanometre.
struct Planes {
  struct Plane {
    Eigen::Vector3d normal;
    double height_m = 0;  // of the origin of coordinates above it
  };
  std::array<Plane, 32> of_point;
  Plane of_center;
};

struct Body {
  Eigen::Vector3d offset_m, velocity_mps, rates_radps;  // from the origin of coordinates; rates against the ground
  Eigen::Matrix3d ecef_from_body;
};

/// From the first 13 components, with offsets in the place of positions.
template <class Vector>
Body body_of(const Vector& y, const Eigen::Vector3d& earth_rate_ecef_radps) {
  Body body;
  body.offset_m = y.template head<3>();
  body.velocity_mps = y.template segment<3>(3);
  Eigen::Quaterniond turned;
  turned.coeffs() = y.template segment<4>(body_quaternion_at);
  body.ecef_from_body = turned.toRotationMatrix();
  body.rates_radps = y.template segment<3>(10) - body.ecef_from_body.transpose() * earth_rate_ecef_radps;
  return body;
}

Planes planes_under(const Ground& ground, const ContactGear& gear, const Eigen::Vector3d& origin_ecef,
                    const Eigen::Matrix3d& ecef_from_body);
ContactMotion motion_of(const ContactGear& gear, const Planes& planes, const Body& body, int point);
Loads loads_on(const ContactGear& gear, const Planes& planes, const Body& body, const GearCommand& command);
/// Whether a point may come to its plane within a time.
bool can_touch(const ContactGear& gear, const Planes& planes, const Body& body, double duration_s);
/// Adds what happened between two moments.
void note(const ContactGear& gear, const Planes& planes, const Body& before, double before_s, const Body& after,
          double after_s, const GearCommand& command, ContactReport& report);
std::uint32_t touching(const ContactGear& gear, const Planes& planes, const Body& body);

/// Farther than any vehicle moves besides by its speed: at 1000 m/s^2, a hundred times gravity.
inline double reserve_m(double duration_s) { return 500 * duration_s * duration_s; }
/// Slower and less accelerated is at rest, with friction under 0.95 of what it can hold; more accelerated is not.
constexpr double still_mps = 3 * friction_speed_mps, still_mps2 = 0.01, woken_mps2 = 0.02;

}  // namespace contact_parts

/// A body that stands at rest, parallel to the ground under `place`: its lowest point on it, springs unloaded, facing
/// `yaw_rad`.
BodyState standing_body(const Environment& environment, const ContactGear& gear, const Ground& ground,
                        const geodesy::Geodetic& place, double yaw_rad);

/// Moves a vehicle over ground, and on it.
///
/// Away from the ground a step is the caller's own and costs a distance more: a ball without ground around a place is
/// remembered, and only its border calls for another look. Where a point could come to the ground within a step, the
/// step is integrated by Rosenbrock's method with errors kept to the tolerance, which takes any stiffness and finds the
/// onset by it. What has come to stand is held in place while loads change by less than 0.02 m/s^2, without creep.
///
/// `Vector` begins with a `BodyVector`. `motion(t_s, x, loads, height_m)` gives its derivative under contact loads
/// besides its own, at a height above ground (infinite above `low_m`). `fly(f, t_s, end_s, x)` integrates the
/// derivative f(t_s, x) away from the ground, as the caller likes it. Same arguments, same bits.
template <class Vector>
class GroundContact {
 public:
  /// `low_m`: below this height above ground the motion is told its height. `tolerance`: of steps with contact; a
  /// speed's has to be less than `friction_speed_mps`.
  GroundContact(ContactGear gear, std::shared_ptr<const Ground> ground, const Eigen::Vector3d& earth_rate_ecef_radps,
                double low_m, Tolerance<Vector> tolerance)
      : gear_(std::move(gear)),
        ground_(std::move(ground)),
        earth_rate_(earth_rate_ecef_radps),
        low_m_(low_m),
        tolerance_(std::move(tolerance)) {}

  /// A micrometre, and what goes with it at a metre and a tenth of a second. `like`: any state of the size to come.
  static Tolerance<Vector> usual_tolerance(const Vector& like) {
    Vector absolute = like;
    absolute.setConstant(1e-5);
    absolute.template head<3>().setConstant(1e-6);
    absolute.template segment<4>(body_quaternion_at).setConstant(1e-6);
    return {absolute, 1e-6};
  }

  /// `x` at `t_s` becomes the state at `end_s`; both `x` and `state` are left as they are on failure.
  template <class Motion, class Fly>
  Result<ContactReport> advance(const Motion& motion, const Fly& fly, double t_s, double end_s,
                                const GearCommand& command, Vector& x, ContactState& state, ContactWork& work) const {
    using namespace contact_parts;
    constexpr double far_m = std::numeric_limits<double>::infinity();
    const double duration_s = end_s - t_s;
    const double moved_m = duration_s * x.template segment<3>(3).norm() + reserve_m(duration_s);
    const double least_m = moved_m + std::max(gear_.reach_m(), low_m_);

    // Within the ball that is known to be clear, or another one around here
    if (!state.resting) {
      const Eigen::Vector3d here = x.template head<3>();
      const auto inside = [&] { return (here - state.clear_center_ecef).norm() + least_m < state.clear_m; };
      const auto look = [&] {
        state.clear_center_ecef = here;
        state.clear_m = ground_->clear_m({here});
        ++work.looks;
        return inside();
      };
      if (inside() || look()) {
        ++work.clear_steps;
        state.touching = 0;
        const auto away = [&](double time_s, const Vector& at) { return motion(time_s, at, Loads{}, far_m); };
        if (auto done = fly(away, t_s, end_s, x); !done) return fail(done);
        return ContactReport{};
      }
    }

    // Low: coordinates from here on
    const Eigen::Vector3d origin = x.template head<3>();
    Vector y = x;
    y.template head<3>().setZero();
    const Body body = body_of(y, earth_rate_);
    if (state.resting) {
      auto rested = rest(motion, fly, t_s, end_s, command, x, state, work);
      if (!rested) return fail(rested);
      if (*rested) return ContactReport{};
    }
    const Planes planes = planes_under(*ground_, gear_, origin, body.ecef_from_body);
    work.looks += 1 + static_cast<std::int64_t>(gear_.points().size());
    const auto height_m = [&](const Vector& local) {
      return planes.of_center.height_m + planes.of_center.normal.dot(local.template head<3>());
    };
    const auto placed = [&](const Vector& local) {
      Vector at = local;
      at.template head<3>() += origin;
      return at;
    };

    if (!can_touch(gear_, planes, body, duration_s)) {
      ++work.low_steps;
      state.touching = 0;
      const auto low = [&](double time_s, const Vector& at) {
        return motion(time_s, at, Loads{},
                      planes.of_center.height_m + planes.of_center.normal.dot(at.template head<3>() - origin));
      };
      if (auto done = fly(low, t_s, end_s, x); !done) return fail(done);
      return ContactReport{};
    }

    // In contact, or nearly so
    ++work.contact_steps;
    const auto touched = [&](double time_s, const Vector& local) {
      return motion(time_s, placed(local), loads_on(gear_, planes, body_of(local, earth_rate_), command),
                    height_m(local));
    };
    Adaptive<Rosenbrock<Vector>> steps(tolerance_, {.first_s = state.step_s, .most_steps = 20'000});
    ContactReport report;
    auto done = steps.start(touched, t_s, y);
    Body before = body;
    while (done && steps.time_s() < end_s) {
      done = steps.step(touched, end_s);
      if (!done) break;
      const Body after = body_of(steps.state(), earth_rate_);
      note(gear_, planes, before, steps.before_s(), after, steps.time_s(), command, report);
      before = after;
    }
    work.contact += steps.work();
    if (!done) return fail(done);
    y = steps.state();
    renormalise_quaternion(y, body_quaternion_at);
    state.step_s = steps.next_step_s();
    state.touching = touching(gear_, planes, before);
    settle(touched, end_s, planes, command, y, state, work);
    x = placed(y);
    return report;
  }

  const ContactGear& gear() const { return gear_; }
  const Ground& ground() const { return *ground_; }

  /// At a state that has come of `advance`.
  GroundTouch touch(const Vector& x, const ContactState& state, const GearCommand& command) const {
    using namespace contact_parts;
    GroundTouch out;
    const Eigen::Vector3d here = x.template head<3>();
    const double least_m = std::max(gear_.reach_m(), low_m_);
    if (!state.resting && (here - state.clear_center_ecef).norm() + least_m < state.clear_m) return out;
    Vector y = x;
    y.template head<3>().setZero();
    const Body body = body_of(y, earth_rate_);
    const Planes planes = planes_under(*ground_, gear_, here, body.ecef_from_body);
    out.height_m = planes.of_center.height_m;
    out.touching = touching(gear_, planes, body);
    out.loads = state.resting ? state.held : loads_on(gear_, planes, body, command);
    out.normal_n = planes.of_center.normal.dot(body.ecef_from_body * out.loads.force_body_n);
    return out;
  }

 private:
  /// Comes to rest where nothing moves and nothing is about to: faster than friction creeps is not rest.
  template <class Touched>
  void settle(const Touched& touched, double time_s, const contact_parts::Planes& planes, const GearCommand& command,
              Vector& y, ContactState& state, ContactWork& work) const {
    using namespace contact_parts;
    Body body = body_of(y, earth_rate_);
    const double reach_m = gear_.reach_m();
    if (!state.touching || body.velocity_mps.norm() + reach_m * body.rates_radps.norm() > still_mps) return;
    Vector change = y;
    evaluate(touched, time_s, y, change, work.contact);
    if (!still(change, still_mps2)) return;
    state.resting = true;
    state.held = loads_on(gear_, planes, body, command);
    state.held_command = command;
    y.template segment<3>(3).setZero();
    y.template segment<3>(10) = body.ecef_from_body.transpose() * earth_rate_;
  }

  bool still(const Vector& change, double limit_mps2) const {
    return change.template segment<3>(3).norm() + gear_.reach_m() * change.template segment<3>(10).norm() < limit_mps2;
  }

  /// Stays where it is, unless loads have changed by too much since it settled: then false.
  template <class Motion, class Fly>
  Result<bool> rest(const Motion& motion, const Fly& fly, double t_s, double end_s, const GearCommand& command,
                    Vector& x, ContactState& state, ContactWork& work) const {
    const double height_m = ground_->under({x.template head<3>()}).height_m;
    ++work.looks;
    const auto held = [&](double time_s, const Vector& at) { return motion(time_s, at, state.held, height_m); };
    Vector change = x;
    evaluate(held, t_s, x, change, work.contact);
    if (!(command == state.held_command) || !still(change, contact_parts::woken_mps2)) {
      state.resting = false;
      state.step_s = 0;
      return false;
    }
    if (x.size() > BodyVector::SizeAtCompileTime) {  // what else the vehicle integrates goes on as in the air
      const auto others = [&](double time_s, const Vector& at) {
        Vector rate = held(time_s, at);
        rate.template head<BodyVector::SizeAtCompileTime>().setZero();
        return rate;
      };
      const BodyVector stands = x.template head<BodyVector::SizeAtCompileTime>();
      if (auto done = fly(others, t_s, end_s, x); !done) return fail(done);
      x.template head<BodyVector::SizeAtCompileTime>() = stands;
    }
    ++work.resting_steps;
    return true;
  }

  ContactGear gear_;
  std::shared_ptr<const Ground> ground_;
  Eigen::Vector3d earth_rate_;
  double low_m_;
  Tolerance<Vector> tolerance_;
};

}  // namespace nadir::sim

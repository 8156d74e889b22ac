#pragma once

#include <optional>
#include <string>

#include "nadir/sim/flown_vehicle.h"
#include "nadir/sim/ground_contact.h"
#include "nadir/sim/integrator.h"

namespace nadir::sim {

// What flown vehicles of all kinds have in common.

/// What adaptive steps may err, each: attitude by what it moves the ground by that a camera sees a kilometre away; what
/// is integrated beside the body, such as speeds of rotors, a hundred times the number. `like`: of the vector's size.
template <class Vector>
Tolerance<Vector> motion_tolerance(const Vector& like, double tolerance_m) {
  Tolerance<Vector> tolerance{like, 0};
  tolerance.absolute.setConstant(100 * tolerance_m);
  tolerance.absolute.template head<BodyVector::SizeAtCompileTime>().setConstant(tolerance_m);
  tolerance.absolute.template segment<4>(body_quaternion_at).setConstant(tolerance_m / 2000);  // half angles
  return tolerance;
}

/// Over a time by an integrator's steps, the quaternion kept at its length. Refers to the integrator.
template <class Vector>
auto flown_by(Integrator<Vector>& integrator) {
  return [&integrator](const auto& motion, double from_s, double to_s, Vector& x) -> Result<void> {
    if (auto ok = integrator.advance(motion, from_s, to_s, x); !ok) return ok;
    renormalise_quaternion(x, body_quaternion_at);
    return {};
  };
}

/// A scheme for a part of a period, with steps no longer than those of the whole.
Scheme scheme_of_part(Scheme scheme, std::int64_t part_ns, std::int64_t whole_ns);

/// What is known of any body: all but specific force, commands, the way off the path and channels.
FlightData data_of(const BodyState& body, const BodyInAir& in_air, const AirMotion& air);

/// The first that breaks or must not touch.
struct GearCrash {
  std::int64_t time_ns = 0;
  std::string what;  // "the left skid breaks"
};
std::optional<GearCrash> crash_of(const ContactReport& report, const ContactGear& gear, std::int64_t from_ns,
                                  std::int64_t to_ns);

}  // namespace nadir::sim

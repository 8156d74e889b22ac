#pragma once

#include <memory>
#include <type_traits>

#include "nadir/sim/ground_contact.h"
#include "nadir/sim/multirotor_motion.h"

namespace nadir::sim {

/// A vehicle's own gear; where it has none, one that follows from its rotors.
///
/// Four skids stand at 0.8 of how far hubs reach forward and to the right, under the centre of mass by 0.6 of the
/// farthest hub's distance. They give by 4 mm under the weight, so that it swings on them at 50 rad/s, with 0.3 of
/// critical damping; a touch-down at 1 m/s on all four takes 8 mm and six times the weight, and one at about 3 m/s,
/// which is 28 times the weight, breaks them. Tips of rotors, belly and top may not touch. Hubs of lumped rotors are
/// taken to reach as far, forward and to the right, as the radius of gyration about z.
ContactGear gear_of(const Multirotor& vehicle);

/// Farther from the ground than this many times its greatest rotor's radius a vehicle has no ground effect, which is
/// 2.5e-5 of the thrust there.
inline constexpr double ground_effect_radii = 50;

/// A multirotor and the ground. `Vector`: as the vehicle is integrated.
template <class Vector>
GroundContact<Vector> ground_for(const Multirotor& vehicle, std::shared_ptr<const Ground> ground,
                                 const Environment& environment, const Vector& like);

/// A motion as `GroundContact` asks for it. Refers to it.
template <class Vector>
auto over_ground(const MultirotorMotion& motion) {
  return [&motion](double t_s, const Vector& x, const Loads& of_ground, double height_m) -> Vector {
    if constexpr (std::is_same_v<Vector, BodyVector>) {
      return motion(t_s, x, of_ground, height_m);
    } else {
      Vector change;
      motion(t_s, x, change, of_ground, height_m);
      return change;
    }
  };
}

}  // namespace nadir::sim

#pragma once

#include "nadir/sim/multirotor.h"

namespace nadir::sim {

/// A multirotor's state as numbers for an integrator: the body's 13, then the speeds of rotors with inertia, then
/// currents where they are integrated, then the charge of a battery. What stands behind lags is not in it: it is exact.
using MultirotorVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 13 + 2 * most_rotors + 1, 1>;
Eigen::Index vector_size(const Multirotor& vehicle, CurrentModel currents);
MultirotorVector to_vector(const Multirotor& vehicle, const MultirotorState& state, CurrentModel currents);

/// Change of a state with time while controls are held: a derivative for `Integrator` and `rk4_step`, over
/// `MultirotorVector`, or over `BodyVector` for a vehicle that adds nothing. Refers to its arguments.
class MultirotorMotion {
 public:
  MultirotorMotion(const Multirotor& vehicle, const Environment& environment, const MultirotorState& from,
                   const MultirotorControls& controls, const AirOverTime& air, double from_s, CurrentModel currents)
      : vehicle_(vehicle),
        environment_(environment),
        from_(from),
        controls_(controls),
        air_(air),
        from_s_(from_s),
        currents_(currents) {}

  /// Away from any ground, or under the loads of one, at a height of the centre of mass above it.
  BodyVector operator()(double t_s, const BodyVector& x, const Loads& of_ground = {},
                        double height_m = no_ground_m) const;
  void operator()(double t_s, const MultirotorVector& x, MultirotorVector& change, const Loads& of_ground = {},
                  double height_m = no_ground_m) const;

  /// The state of a vector; limits are kept: speeds and charge do not fall below 0.
  MultirotorState state_at(double t_s, const BodyVector& x) const;
  MultirotorState state_at(double t_s, const MultirotorVector& x) const;

 private:
  const Multirotor& vehicle_;
  const Environment& environment_;
  const MultirotorState& from_;
  const MultirotorControls& controls_;
  const AirOverTime& air_;
  double from_s_;
  CurrentModel currents_;
};

/// How fast the fastest rotor returns to its balance from near given speeds, 1/s; 0 where none has inertia.
double fastest_spin_rate_per_s(const Multirotor& vehicle, const RotorValues& omega_radps, double density_kgpm3);

}  // namespace nadir::sim

#pragma once

#include <Eigen/Core>

#include "nadir/base/result.h"

namespace nadir::sim {

/// One step of the classical Runge-Kutta method: `x` at `t_s` becomes the result at `t_s + dt_s`.
/// `derivative(t_s, x)` gives dx/dt as a vector like `x`. It is asked four times, and whatever it computes (forces,
/// wind) follows the state within the step. Error: a step is off by O(dt^5), a flight of fixed duration by O(dt^4),
/// where the derivative is smooth. Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, 1993,
/// table II.1.2.
template <class Vector, class Derivative>
Vector rk4_step(const Derivative& derivative, double t_s, const Vector& x, double dt_s) {
  const double half = 0.5 * dt_s;
  const Vector k1 = derivative(t_s, x);
  const Vector k2 = derivative(t_s + half, Vector(x + half * k1));
  const Vector k3 = derivative(t_s + half, Vector(x + half * k2));
  const Vector k4 = derivative(t_s + dt_s, Vector(x + dt_s * k3));
  return x + (dt_s / 6) * (k1 + 2 * (k2 + k3) + k4);
}

/// Scales the quaternion whose four components begin at `first` to unit length. The exact flow keeps its length, so
/// this takes away only what a step got wrong, and leaves the order of the method as it is.
template <class Vector>
void renormalise_quaternion(Vector& x, Eigen::Index first) {
  x.template segment<4>(first).normalize();
}

/// The new state, or an error where a component is infinite or not a number: the motion has diverged, and `t_s` says
/// when. The error names the component by its index.
template <class Vector>
Result<Vector> finite_or_error(const Vector& x, double t_s);

/// What `finite_or_error` says of a state with a component that is not finite.
Error not_finite(const Eigen::Ref<const Eigen::VectorXd>& x, double t_s);

template <class Vector>
Result<Vector> finite_or_error(const Vector& x, double t_s) {
  if (x.allFinite()) return x;
  return tl::unexpected(not_finite(x, t_s));
}

}  // namespace nadir::sim

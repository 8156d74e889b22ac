#pragma once

#include <Eigen/Core>

#include "nadir/base/result.h"
#include "nadir/sim/derivative.h"

namespace nadir::sim {

/// Runge-Kutta methods with a fixed step. Error of a flight of fixed duration: O(dt) of Euler's, O(dt^2) of the
/// midpoint rule and Heun's, O(dt^4) of the classical one, where the derivative is smooth. Stable on dx/dt = -rate x up
/// to rate dt = 2, 2, 2 and 2.785; an oscillation without damping grows for ever under all but the last, which damps it
/// up to a frequency of 2.828/dt. Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, 1993,
/// tables II.1.1 and II.1.2.
enum class ExplicitMethod { Euler, Midpoint, Heun, Rk4 };

/// Evaluations a step takes.
int stages_of(ExplicitMethod method);

/// Takes steps by one method, and owns the space for it: no step allocates where the derivative does not. What the
/// derivative computes (forces, wind) follows the state within the step.
template <class Vector>
class ExplicitStepper {
 public:
  /// `like`: any state of the size that is to come.
  ExplicitStepper(ExplicitMethod method, const Vector& like)
      : method_(method), k1_(like), k2_(like), k3_(like), k4_(like), stage_(like) {}

  /// `x` at `t_s` becomes the result at `t_s + dt_s`.
  template <class F>
  void step(const F& f, double t_s, Vector& x, double dt_s, Work& work) {
    ++work.steps;
    evaluate(f, t_s, x, k1_, work);
    const double half = 0.5 * dt_s;
    switch (method_) {
      case ExplicitMethod::Euler:
        x += dt_s * k1_;
        return;
      case ExplicitMethod::Midpoint:
        stage_ = x + half * k1_;
        evaluate(f, t_s + half, stage_, k2_, work);
        x += dt_s * k2_;
        return;
      case ExplicitMethod::Heun:
        stage_ = x + dt_s * k1_;
        evaluate(f, t_s + dt_s, stage_, k2_, work);
        x += half * (k1_ + k2_);
        return;
      case ExplicitMethod::Rk4:
        stage_ = x + half * k1_;
        evaluate(f, t_s + half, stage_, k2_, work);
        stage_ = x + half * k2_;
        evaluate(f, t_s + half, stage_, k3_, work);
        stage_ = x + dt_s * k3_;
        evaluate(f, t_s + dt_s, stage_, k4_, work);
        x += (dt_s / 6) * (k1_ + 2 * (k2_ + k3_) + k4_);
        return;
    }
  }

 private:
  ExplicitMethod method_;
  Vector k1_, k2_, k3_, k4_, stage_;
};

/// One step of the classical Runge-Kutta method: `x` at `t_s` becomes the result at `t_s + dt_s`.
/// `derivative(t_s, x)` gives dx/dt as a vector like `x`, and is asked four times.
template <class Vector, class Derivative>
Vector rk4_step(const Derivative& derivative, double t_s, const Vector& x, double dt_s) {
  Vector next = x;
  Work work;
  ExplicitStepper<Vector>(ExplicitMethod::Rk4, x).step(derivative, t_s, next, dt_s, work);
  return next;
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

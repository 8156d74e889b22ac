#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <concepts>

#include "nadir/sim/work.h"

namespace nadir::sim {

/// A square matrix as wide as a state.
template <class Vector>
using MatrixOf = Eigen::Matrix<double, Vector::RowsAtCompileTime, Vector::RowsAtCompileTime>;

/// A derivative that writes into its third argument: what a state of dynamic size needs to be free of allocations.
template <class F, class Vector>
concept WritesDerivative = requires(const F& f, const Vector& x, Vector& change) {
  f(0.0, x, change);
};

/// A derivative with its own `jacobian(t_s, x, matrix)`: entry (i, j) is the slope of component i along component j.
template <class F, class Vector>
concept GivesJacobian = requires(const F& f, const Vector& x, MatrixOf<Vector>& slopes) {
  f.jacobian(0.0, x, slopes);
};

/// A derivative that says by `static constexpr bool autonomous = true` that it does not depend on time.
template <class F>
concept Autonomous = requires {
  requires F::autonomous;
};

/// dx/dt, from a function `f(t_s, x)` that returns it or `f(t_s, x, change)` that writes it. Both are pure.
template <class F, class Vector>
void evaluate(const F& f, double t_s, const Vector& x, Vector& change, Work& work) {
  ++work.evaluations;
  if constexpr (WritesDerivative<F, Vector>)
    f(t_s, x, change);
  else
    change = f(t_s, x);
}

/// A distance for a difference quotient in a component of size `value`: half of the digits are left for it. States are
/// in SI units, and components are taken to be 1e-3 at least.
inline double difference_distance(double value) {
  return 0x1p-26 * std::max(std::abs(value), 1e-3);  // square root of a double's precision
}

/// Slopes of `f` at a state where it is `change`: given by `f`, or by forward differences, one evaluation a component.
/// `moved` and `there` are space to work in. Error of differences: about 1e-8 of the slopes' size.
template <class F, class Vector>
void jacobian(const F& f, double t_s, const Vector& x, const Vector& change, MatrixOf<Vector>& slopes, Vector& moved,
              Vector& there, Work& work) {
  ++work.jacobians;
  if constexpr (GivesJacobian<F, Vector>) {
    f.jacobian(t_s, x, slopes);
  } else {
    moved = x;
    for (Eigen::Index j = 0; j < x.size(); ++j) {
      moved[j] = x[j] + difference_distance(x[j]);
      const double distance = moved[j] - x[j];  // as rounded
      evaluate(f, t_s, moved, there, work);
      slopes.col(j) = (there - change) / distance;
      moved[j] = x[j];
    }
  }
}

}  // namespace nadir::sim

// Boost.odeint as an independent integrator.
#pragma once

#include <array>
#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>
#include <cstdint>

#include "motions.h"

namespace nadir::bench {

template <int n>
struct Arrived {
  typename Motion<n>::Vector x;
  std::int64_t evaluations = 0;
};

/// The whole motion by an adaptive method of odeint, at a tolerance in `Motion::one`.
template <class Stepper, int n>
Arrived<n> by_odeint(const Motion<n>& motion, double tolerance) {
  namespace odeint = boost::numeric::odeint;
  using State = std::array<double, n>;
  using Mapped = Eigen::Map<typename Motion<n>::Vector>;
  using Looked = Eigen::Map<const typename Motion<n>::Vector>;
  Arrived<n> arrived;
  // Scaled by `one`, since odeint's tolerance is the same for all components
  State x;
  Mapped(x.data()) = motion.start.cwiseQuotient(motion.one);
  double step_s = motion.interval_s / 16;
  for (int i = 0; i < motion.intervals; ++i) {
    const auto f = motion.derivative_of(i);
    const auto scaled = [&](const State& s, State& change, double t_s) {
      ++arrived.evaluations;
      Mapped(change.data()) = f(t_s, Looked(s.data()).cwiseProduct(motion.one)).cwiseQuotient(motion.one);
    };
    odeint::integrate_adaptive(odeint::make_controlled<Stepper>(tolerance, 0.0), scaled, x, i * motion.interval_s,
                               (i + 1) * motion.interval_s, step_s);
  }
  arrived.x = Looked(x.data()).cwiseProduct(motion.one);
  return arrived;
}

/// What errors are measured from: Fehlberg's method of order 8 at 1e-12.
template <int n>
typename Motion<n>::Vector reference(const Motion<n>& motion) {
  return by_odeint<boost::numeric::odeint::runge_kutta_fehlberg78<std::array<double, n>>>(motion, 1e-12).x;
}

/// The peer of `sim::DormandPrince`.
template <int n>
Arrived<n> by_dopri5(const Motion<n>& motion, double tolerance) {
  return by_odeint<boost::numeric::odeint::runge_kutta_dopri5<std::array<double, n>>>(motion, tolerance);
}

}  // namespace nadir::bench

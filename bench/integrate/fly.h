#pragma once

#include "motions.h"
#include "nadir/sim/plan.h"

namespace nadir::bench {

/// A motion flown by one scheme: where it arrived, and what it took.
template <int n>
struct Flown {
  typename Motion<n>::Vector x;
  sim::Work work;
};

template <int n>
sim::Tolerance<typename Motion<n>::Vector> tolerance_of(const Motion<n>& motion, double tolerance) {
  return {tolerance * motion.one, 0};
}

template <int n>
Result<Flown<n>> fly(const Motion<n>& motion, const sim::Scheme& scheme, double tolerance,
                     sim::StepLimits limits = {}) {
  sim::Integrator<typename Motion<n>::Vector> integrator(scheme, motion.start, tolerance_of(motion, tolerance), limits);
  Flown<n> flown{motion.start, {}};
  for (int i = 0; i < motion.intervals; ++i)
    if (const auto done =
            integrator.advance(motion.derivative_of(i), i * motion.interval_s, (i + 1) * motion.interval_s, flown.x);
        !done)
      return fail(done);
  flown.work = integrator.work();
  return flown;
}

}  // namespace nadir::bench

#pragma once

#include <cassert>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nadir/sim/integrator.h"
#include "nadir/sim/stiffness.h"

namespace nadir::sim {

/// A flight to try schemes on: `intervals` of `interval_s` each, from control to control.
struct Trial {
  double start_s = 0;
  double interval_s = 0.01;  // > 0
  int intervals = 100;       // > 0
  CostModel cost;
  std::int64_t most_steps = 200'000;  // of one interval of an adaptive scheme; fixed ones cost no more than those
};

/// What became of one scheme on the trial.
struct Candidate {
  Scheme scheme;
  Work work;
  double cost = 0;              // evaluations it is worth
  std::optional<double> error;  // the greatest at an interval's end, in tolerances of the motion; none: it failed
  std::string fault;            // why

  bool meets() const { return error && *error <= 1; }
};

/// The cheapest scheme that met the tolerance on the trial, and all that were tried.
struct Plan {
  Scheme scheme;
  Candidate chosen;
  std::vector<Candidate> tried;
  double greatest_rate_per_s = 0;   // spectral radius of the Jacobian at the start
  double limited_by_stability = 0;  // share of the explicit method's steps
  bool stiff = false;               // so an implicit scheme was tried
  std::string why;                  // one line, for people
};

namespace plan_parts {

/// The scheme on the whole trial: states at the ends of its intervals, all of them where it arrives.
template <class Vector, class DerivativeOf>
std::vector<Vector> fly(const DerivativeOf& derivative_of, const Vector& start, const Tolerance<Vector>& tolerance,
                        const Trial& trial, const Scheme& scheme, Candidate& candidate) {
  Integrator<Vector> integrator(scheme, start, tolerance, {.most_steps = trial.most_steps});
  Vector x = start;
  std::vector<Vector> ends;
  candidate.scheme = scheme;
  for (int i = 0; i < trial.intervals; ++i) {
    const auto done = integrator.advance(derivative_of(i), trial.start_s + i * trial.interval_s,
                                         trial.start_s + (i + 1) * trial.interval_s, x);
    if (!done) {
      candidate.fault = done.error().message;
      break;
    }
    ends.push_back(x);
  }
  candidate.work = integrator.work();
  candidate.cost = cost_of(candidate.work, start.size(), GivesJacobian<decltype(derivative_of(0)), Vector>, trial.cost);
  return ends;
}

/// Share of the steps of Dormand and Prince's method over the trial that stability limits.
template <class Vector, class DerivativeOf>
double limited_by_stability(const DerivativeOf& derivative_of, const Vector& start, const Tolerance<Vector>& tolerance,
                            const Trial& trial) {
  using Method = DormandPrince<Vector>;
  Adaptive<Method> steps(tolerance, {.most_steps = trial.most_steps});
  Vector x = start;
  double limited = 0, all = 0;
  for (int i = 0; i < trial.intervals; ++i) {
    const auto f = derivative_of(i);
    const double end_s = trial.start_s + (i + 1) * trial.interval_s;
    if (!steps.start(f, trial.start_s + i * trial.interval_s, x)) break;
    while (steps.time_s() < end_s) {
      if (!steps.step(f, end_s)) break;
      ++all;
      limited += steps.stiffness() > 0.75 * Method::stability_limit;
    }
    if (steps.time_s() < end_s) break;
    x = steps.state();
  }
  return all > 0 ? limited / all : 0;
}

}  // namespace plan_parts

/// In words, what decided on whether an implicit scheme is tried.
std::string stiffness_told(const Plan& plan);

/// The cheapest scheme that meets the tolerance, by `attempt`, which flies a scheme over the trial and says what became
/// of it. Adaptive schemes are tightened until they meet it, fixed steps halved for as long as they would be cheaper
/// than what has met it. An implicit scheme is attempted where `plan` says that the motion is stiff. Fails where none
/// meets it. `because`: how `Plan::why` begins.
Result<Plan> cheapest_scheme(Plan plan, const Trial& trial, const std::string& because,
                             const std::function<Candidate(const Scheme&)>& attempt);

/// Flies the trial by one scheme after the other, and takes the cheapest that meets the tolerance at the end of each
/// interval. Cost is counted work, so that the same trial gives the same plan everywhere. An implicit scheme is tried
/// only where stability limits at least a tenth of the explicit method's steps, or where that fails. The reference is
/// the adaptive method of the kind, 1e-4 times tighter. Fails where no scheme meets the tolerance, and says what became
/// of each. `derivative_of(i)` gives the derivative in interval i: inputs that a controller holds change from one to
/// the next.
template <class Vector, class DerivativeOf>
Result<Plan> choose_scheme(const DerivativeOf& derivative_of, const Vector& start, const Tolerance<Vector>& tolerance,
                           const Trial& trial) {
  assert(trial.interval_s > 0 && trial.intervals > 0);
  using Method = Scheme::Method;
  Plan plan;
  Work look;
  plan.greatest_rate_per_s = spectral_radius(derivative_of(0), trial.start_s, start, look);
  plan.limited_by_stability = plan_parts::limited_by_stability(derivative_of, start, tolerance, trial);
  const auto fly = [&](const Scheme& scheme, Candidate& candidate) {
    return plan_parts::fly(derivative_of, start, tolerance, trial, scheme, candidate);
  };

  Candidate reference_run;
  plan.stiff = plan.limited_by_stability >= 0.1;
  std::vector<Vector> reference;
  if (!plan.stiff) reference = fly({.method = Method::DormandPrince, .tightness = 1e-4}, reference_run);
  if (plan.stiff || !reference_run.fault.empty()) {
    plan.stiff = true;
    Candidate implicit_run;
    reference = fly({.method = Method::Rosenbrock, .tightness = 1e-4}, implicit_run);
    if (!implicit_run.fault.empty())
      return fail(Error::Kind::Unsupported, "no scheme flies this motion: " + implicit_run.fault);
  }

  const std::string because = stiffness_told(plan);
  return cheapest_scheme(std::move(plan), trial, because, [&](const Scheme& scheme) {
    Candidate candidate;
    const auto ends = fly(scheme, candidate);
    if (candidate.fault.empty()) {
      candidate.error = 0;
      for (std::size_t i = 0; i < ends.size(); ++i) {
        const Vector off = ends[i] - reference[i];
        const double error = in_tolerances(off, reference[i], ends[i], tolerance);
        if (!(error <= *candidate.error)) candidate.error = error;
      }
    }
    return candidate;
  });
}

}  // namespace nadir::sim

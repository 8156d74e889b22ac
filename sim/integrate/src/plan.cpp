#include "nadir/sim/plan.h"

#include <fmt/format.h>

namespace nadir::sim {
namespace {

std::string told(const Scheme& scheme) {
  if (is_fixed(scheme.method))
    return fmt::format("{} with {} step{} an interval", name_of(scheme.method), scheme.steps,
                       scheme.steps == 1 ? "" : "s");
  return fmt::format("{} at {:g} of the tolerance", name_of(scheme.method), scheme.tightness);
}

}  // namespace

const char* name_of(Scheme::Method method) {
  switch (method) {
    case Scheme::Method::Euler:
      return "euler";
    case Scheme::Method::Midpoint:
      return "midpoint";
    case Scheme::Method::Heun:
      return "heun";
    case Scheme::Method::Rk4:
      return "rk4";
    case Scheme::Method::DormandPrince:
      return "dormand-prince";
    case Scheme::Method::Rosenbrock:
      break;
  }
  return "rosenbrock";
}

bool is_fixed(Scheme::Method method) {
  return method != Scheme::Method::DormandPrince && method != Scheme::Method::Rosenbrock;
}

ExplicitMethod explicit_method(Scheme::Method method) {
  assert(is_fixed(method));
  switch (method) {
    case Scheme::Method::Euler:
      return ExplicitMethod::Euler;
    case Scheme::Method::Midpoint:
      return ExplicitMethod::Midpoint;
    case Scheme::Method::Heun:
      return ExplicitMethod::Heun;
    default:
      return ExplicitMethod::Rk4;
  }
}

double cost_of(const Work& work, std::int64_t size, bool gives_jacobian, const CostModel& model) {
  const auto n = static_cast<double>(size);
  const double flops = model.flops_per_evaluation > 0 ? model.flops_per_evaluation : 20 * n;
  const double algebra =
      static_cast<double>(work.factorisations) * n * n * n * 2 / 3 + static_cast<double>(work.solves) * 2 * n * n;
  const double given = gives_jacobian ? static_cast<double>(work.jacobians) * model.given_jacobian : 0;
  return static_cast<double>(work.evaluations) + given + algebra / flops;
}

std::string reason_of(const Plan& plan, int intervals) {
  std::string why = fmt::format("greatest rate {:.3g}/s; stability limits {:.0f} % of an explicit method's steps, so ",
                                plan.greatest_rate_per_s, 100 * plan.limited_by_stability);
  why += plan.stiff ? "an implicit one was tried" : "no implicit one was tried";
  // The best of each method
  for (int m = 0; m <= static_cast<int>(Scheme::Method::Rosenbrock); ++m) {
    const Candidate* best = nullptr;
    const Candidate* last = nullptr;
    for (const Candidate& one : plan.tried)
      if (one.scheme.method == static_cast<Scheme::Method>(m)) {
        last = &one;
        if (one.error && *one.error <= 1 && (!best || one.cost < best->cost)) best = &one;
      }
    if (best)
      why += fmt::format("; {}: {:.4g} evaluations an interval, error {:.2g} of the tolerance", told(best->scheme),
                         best->cost / intervals, *best->error);
    else if (last)
      why += fmt::format("; {}: {}", told(last->scheme),
                         last->error ? fmt::format("error {:.2g} of the tolerance", *last->error) : last->fault);
  }
  return why;
}

}  // namespace nadir::sim

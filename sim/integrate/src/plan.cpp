#include "nadir/sim/plan.h"

#include <fmt/format.h>

#include <array>

#include "nadir/base/text.h"

namespace nadir::sim {
namespace {
constexpr std::array<std::string_view, 6> method_names = {"euler", "midpoint",       "heun",
                                                          "rk4",   "dormand-prince", "rosenbrock"};
}  // namespace

std::string_view name_of(Scheme::Method method) { return method_names[static_cast<std::size_t>(method)]; }

Result<Scheme::Method> parse_method(std::string_view text) {
  return parse_name<Scheme::Method>("method", text, method_names);
}

std::string to_string(const Scheme& scheme) {
  if (is_fixed(scheme.method))
    return fmt::format("{} with {} step{} an interval", name_of(scheme.method), scheme.steps,
                       scheme.steps == 1 ? "" : "s");
  return fmt::format("{} at {:g} of the tolerance", name_of(scheme.method), scheme.tightness);
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

Work& Work::operator+=(const Work& other) {
  evaluations += other.evaluations;
  jacobians += other.jacobians;
  factorisations += other.factorisations;
  solves += other.solves;
  steps += other.steps;
  rejected += other.rejected;
  return *this;
}

double cost_of(const Work& work, std::int64_t size, bool gives_jacobian, const CostModel& model) {
  const auto n = static_cast<double>(size);
  const double flops = model.flops_per_evaluation > 0 ? model.flops_per_evaluation : 20 * n;
  const double algebra =
      static_cast<double>(work.factorisations) * n * n * n * 2 / 3 + static_cast<double>(work.solves) * 2 * n * n;
  const double given = gives_jacobian ? static_cast<double>(work.jacobians) * model.given_jacobian : 0;
  return static_cast<double>(work.evaluations) + given + algebra / flops;
}

namespace {

/// The best of each method.
std::string told(const std::vector<Candidate>& tried, int intervals) {
  std::string text;
  for (int m = 0; m <= static_cast<int>(Scheme::Method::Rosenbrock); ++m) {
    const Candidate* best = nullptr;
    const Candidate* last = nullptr;
    for (const Candidate& one : tried)
      if (one.scheme.method == static_cast<Scheme::Method>(m)) {
        last = &one;
        if (one.meets() && (!best || one.cost < best->cost)) best = &one;
      }
    if (best)
      text += fmt::format("; {}: {:.4g} evaluations an interval, error {:.2g} of the tolerance",
                          to_string(best->scheme), best->cost / intervals, *best->error);
    else if (last)
      text += fmt::format("; {}: {}", to_string(last->scheme),
                          last->error ? fmt::format("error {:.2g} of the tolerance", *last->error) : last->fault);
  }
  return text;
}

/// What would be met; nothing where no scheme came to an end.
std::string advice(const std::vector<Candidate>& tried) {
  const Candidate* nearest = nullptr;
  for (const Candidate& one : tried)
    if (one.error && (!nearest || *one.error < *nearest->error)) nearest = &one;
  if (!nearest) return "";
  return fmt::format("; one of {:.2g} times as much is met by {}", 1.1 * *nearest->error, to_string(nearest->scheme));
}

}  // namespace

std::string stiffness_told(const Plan& plan) {
  return fmt::format("greatest rate {:.3g}/s; stability limits {:.0f} % of an explicit method's steps, so {}",
                     plan.greatest_rate_per_s, 100 * plan.limited_by_stability,
                     plan.stiff ? "an implicit one was tried" : "no implicit one was tried");
}

Result<Plan> cheapest_scheme(Plan plan, const Trial& trial, const std::string& because,
                             const std::function<Candidate(const Scheme&)>& attempt) {
  using Method = Scheme::Method;
  const auto met = [&](const Scheme& scheme) {
    plan.tried.push_back(attempt(scheme));
    return plan.tried.back().meets();
  };
  const auto cheapest = [&]() -> const Candidate* {
    const Candidate* best = nullptr;
    for (const Candidate& one : plan.tried)
      if (one.meets() && (!best || one.cost < best->cost)) best = &one;
    return best;
  };

  for (const Method method : {Method::DormandPrince, Method::Rosenbrock}) {
    if (method == Method::Rosenbrock && !plan.stiff) continue;
    for (double tightness = 1; tightness > 5e-4; tightness /= 10)
      if (met({.method = method, .tightness = tightness})) break;
  }
  for (const Method method : {Method::Rk4, Method::Heun, Method::Midpoint, Method::Euler}) {
    const int stages = stages_of(explicit_method(method));
    for (int steps = 1; steps <= trial.most_steps; steps *= 2) {
      const Candidate* sure = cheapest();
      if (sure && 1.0 * steps * stages * trial.intervals >= sure->cost) break;
      if (met({.method = method, .steps = steps})) break;
    }
  }

  plan.why = because + told(plan.tried, trial.intervals);
  const Candidate* best = cheapest();
  if (!best)
    return fail(Error::Kind::Unsupported, "no scheme meets the tolerance" + advice(plan.tried) + ": " + plan.why);
  plan.chosen = *best;
  plan.scheme = best->scheme;
  return plan;
}

}  // namespace nadir::sim

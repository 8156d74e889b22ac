#include "integrate_suite.h"

#include <fmt/format.h>

#include <memory>

#include "breaking.h"
#include "fly.h"
#include "odeint.h"

namespace nadir::bench {
namespace {

using sim::Scheme;

/// A motion and where it ends, shared by its methods.
template <int n>
struct Course {
  Motion<n> motion;
  typename Motion<n>::Vector exact;
};
template <int n>
using CoursePtr = std::shared_ptr<const Course<n>>;

template <int n>
Point point_of(const CoursePtr<n>& course, std::int64_t evaluations) {
  return {fmt::format("{}, against work", course->motion.name), static_cast<double>(evaluations),
          "evaluations of the derivative"};
}

std::map<std::string, std::string> told(const sim::Work& work) {
  std::map<std::string, std::string> counters = {{"evaluations", std::to_string(work.evaluations)},
                                                 {"steps", std::to_string(work.steps)}};
  if (work.rejected) counters["rejected"] = std::to_string(work.rejected);
  if (work.jacobians) {
    counters["jacobians"] = std::to_string(work.jacobians);
    counters["factorisations"] = std::to_string(work.factorisations);
    counters["solves"] = std::to_string(work.solves);
  }
  return counters;
}

/// `name`: on the page; methods of one name are joined by a line.
template <int n>
Method method_of(const CoursePtr<n>& course, const std::string& name, const std::string& setting, const Scheme& scheme,
                 double tolerance, std::map<std::string, std::string> further = {}) {
  Method method{.name = name, .setting = setting};
  // Flown once here: what it takes places it in the picture, and what diverges is told rather than timed
  const auto first = fly(course->motion, scheme, tolerance, {.most_steps = 100'000});
  if (!first) {
    method.left_out = first.error().message;
    return method;
  }
  const double error = course->motion.error(first->x, course->exact);
  if (!(error < 1e6)) {
    method.left_out = fmt::format("errs by {:.3g} {}", error, course->motion.unit);
    return method;
  }
  method.run = [=]() -> Result<void> {
    const auto flown = fly(course->motion, scheme, tolerance);
    if (!flown) return fail(flown);
    return {};
  };
  method.error = [=]() -> Result<double> { return error; };
  auto counters = told(first->work);
  counters.merge(further);
  method.counters = [=] { return counters; };
  method.point = point_of(course, first->work.evaluations);
  return method;
}

template <int n>
Method peer_of(const CoursePtr<n>& course, double tolerance) {
  const auto first = by_dopri5(course->motion, tolerance);
  const double error = course->motion.error(first.x, course->exact);
  return {.name = "odeint dopri5",
          .setting = fmt::format("{:.0e}", tolerance),
          .run = [=]() -> Result<void> {
            by_dopri5(course->motion, tolerance);
            return {};
          },
          .error = [=]() -> Result<double> { return error; },
          .counters = [=]() -> std::map<std::string, std::string> {
            return {{"evaluations", std::to_string(first.evaluations)}};
          },
          .point = point_of(course, first.evaluations)};
}

/// The scheme that a plan takes after a look at the first second.
template <int n>
Method planned(const CoursePtr<n>& course, double tolerance) {
  const Motion<n>& motion = course->motion;
  const sim::Trial trial{.interval_s = motion.interval_s,
                         .intervals = std::min(motion.intervals, static_cast<int>(1 / motion.interval_s))};
  const auto plan = sim::choose_scheme(motion.derivative_of, motion.start, tolerance_of(motion, tolerance), trial);
  const std::string setting = fmt::format("{:.0e}", tolerance);
  if (!plan) return {.name = "plan", .setting = setting, .left_out = plan.error().message};
  return method_of(course, "plan", setting, plan->scheme, tolerance,
                   {{"takes", std::string(name_of(plan->scheme.method))}, {"why", as_counter(plan->why)}});
}

template <int n>
Case work_precision(const std::function<Motion<n>()>& make, const RunOptions& options) {
  return {
      make().name, [=]() -> Result<Comparison> {
        const auto course = std::make_shared<Course<n>>(Course<n>{make(), {}});
        Motion<n>& motion = course->motion;
        if (options.quick) motion.intervals = std::max(1, motion.intervals / 10);
        course->exact = reference(motion);
        const CoursePtr<n> shared = course;
        Comparison comparison{.error_unit = motion.unit, .warm_up = false};
        for (const auto method :
             {Scheme::Method::Euler, Scheme::Method::Midpoint, Scheme::Method::Heun, Scheme::Method::Rk4})
          for (int steps = 1; steps <= motion.most_steps; steps *= 4)
            comparison.methods.push_back(method_of(shared, std::string(name_of(method)),
                                                   fmt::format("{} an interval", steps),
                                                   {.method = method, .steps = steps}, 1));
        for (double tolerance = 1e-2; tolerance > 0.5e-10; tolerance /= 100) {
          for (const auto method : {Scheme::Method::DormandPrince, Scheme::Method::Rosenbrock})
            comparison.methods.push_back(method_of(shared, std::string(name_of(method)),
                                                   fmt::format("{:.0e}", tolerance), {.method = method}, tolerance));
          comparison.methods.push_back(peer_of(shared, tolerance));
        }
        for (const double tolerance : {1e-2, 1e-4, 1e-6}) comparison.methods.push_back(planned(shared, tolerance));
        return comparison;
      }};
}

Method method_of(const Breaking& one) {
  const auto outcome = std::make_shared<BreakingOutcome>();
  return {.name = one.name,
          .run = [=]() -> Result<void> {
            *outcome = one.run();
            return {};
          },
          .counters = [=]() -> std::map<std::string, std::string> {
            return {{"expected", as_counter(one.expected)},
                    {"happened",
                     as_counter((outcome->as_expected ? "as expected: " : "NOT AS EXPECTED: ") + outcome->happened)}};
          }};
}

}  // namespace

Suite integrate_suite() {
  return {"integrate", "integrators: error at the end of a motion against work and run time, and where each breaks",
          [](const RunOptions& options) {
            std::vector<Case> cases = {work_precision<2>(harmonic, options), work_precision<7>(rigid_body, options),
                                       work_precision<2>(motor, options), work_precision<4>(landing_gear, options)};
            for (const Flight flight : {Flight::Cruise, Flight::Roll, Flight::Stall, Flight::Gust, Flight::Drop})
              cases.push_back(work_precision<13>([=] { return aerosonde_in(flight); }, options));
            cases.push_back(work_precision<13>(hover, options));
            cases.push_back(work_precision<21>(hover_with_windings, options));
            cases.push_back({"where each breaks", []() -> Result<Comparison> {
                               Comparison comparison{.warm_up = false, .rounds = 3};
                               for (const Breaking& one : breaking_cases())
                                 comparison.methods.push_back(method_of(one));
                               return comparison;
                             }});
            return cases;
          }};
}

}  // namespace nadir::bench

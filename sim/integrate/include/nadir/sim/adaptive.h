#pragma once

#include <cassert>
#include <string>

#include "nadir/sim/derivative.h"
#include "nadir/sim/step_control.h"

namespace nadir::sim {

/// Integrates by `Method` with steps as long as the tolerance allows: `DormandPrince<Vector>` or `Rosenbrock<Vector>`.
/// Each step's estimated error stays within the tolerance; errors of steps add up as the motion has it.
/// One thread at a time. Same arguments, same bits: no clock, and what decides on steps is our own arithmetic. A step
/// allocates nothing where the derivative does not.
template <class Method>
class Adaptive {
 public:
  using Vector = typename Method::Vector;

  explicit Adaptive(Tolerance<Vector> tolerance, StepLimits limits = {})
      : tolerance_(std::move(tolerance)), limits_(limits), method_(tolerance_.absolute), x_(tolerance_.absolute) {}

  /// Begins an interval at a state. `f` may be another than before: the last step's length is where to go on from.
  /// Fails where the derivative is not finite.
  template <class F>
  Result<void> start(const F& f, double t_s, const Vector& x) {
    assert(x.size() == x_.size());
    t_s_ = before_s_ = t_s;
    x_ = x;
    attempts_ = 0;
    method_.start(f, t_s, x, work_);
    if (!x.allFinite() || !method_.derivative().allFinite())
      return tl::unexpected(stopped(Method::name, "the state or its derivative is not finite", t_s, 0, x));
    return {};
  }

  /// One step, at most to `end_s`, which is met exactly. After `start`; `end_s` > `time_s()`. Fails where steps become
  /// too short or too many: the state stays that of the last step taken.
  template <class F>
  Result<void> step(const F& f, double end_s) {
    assert(end_s > t_s_);
    if (next_s_ == 0) next_s_ = limits_.first_s > 0 ? limits_.first_s : first_step(f, end_s - t_s_);
    const double rounding_s = 0x1p-48 * std::max(std::abs(t_s_), std::abs(end_s));
    const double least_s = std::max(limits_.least_s, rounding_s);
    double step_s = std::min(next_s_, limits_.most_s);
    for (;;) {
      const double left_s = end_s - t_s_;
      const bool last = step_s >= left_s * (1 - 1e-3);
      const double wanted_s = step_s;
      if (last)
        step_s = left_s;
      else if (2 * step_s > left_s)
        step_s = 0.5 * left_s;  // two equal ones rather than a long and a tiny one
      if (++attempts_ > limits_.most_steps)
        return tl::unexpected(stopped(Method::name,
                                      "the interval takes more steps than are allowed; " + std::string(Method::advice),
                                      t_s_, step_s, x_));
      const double error = method_.attempt(f, t_s_, x_, step_s, tolerance_, work_);
      if (error <= 1) {  // false where it is not a number
        before_s_ = t_s_;
        t_s_ = last ? end_s : t_s_ + step_s;
        x_ = method_.next();
        method_.accept();
        ++work_.steps;
        // A step cut by the end says little of the next one: no less than what was wanted
        const double proposed_s = step_s * controller_.after_taken(error);
        next_s_ = step_s < wanted_s ? std::max(proposed_s, wanted_s) : proposed_s;
        return {};
      }
      ++work_.rejected;
      step_s *= controller_.after_rejected(error);
      if (step_s < least_s)
        return tl::unexpected(stopped(
            Method::name,
            std::isfinite(error) ? "no step is short enough for the tolerance: the motion jumps or runs away there"
                                 : "the motion leaves the range of numbers however short the step: it diverges there",
            t_s_, step_s, x_));
    }
  }

  /// The interval from `t_s` to `end_s` in one call; `x` is left as it is on failure.
  template <class F>
  Result<void> advance(const F& f, double t_s, double end_s, Vector& x) {
    if (auto started = start(f, t_s, x); !started) return started;
    while (t_s_ < end_s)
      if (auto taken = step(f, end_s); !taken) return taken;
    x = x_;
    return {};
  }

  double time_s() const { return t_s_; }
  double before_s() const { return before_s_; }  // where the last step began
  const Vector& state() const { return x_; }
  double next_step_s() const { return next_s_; }  // that would be tried next; 0 before the first

  /// The state within the last step taken, by the method's own interpolation: of order 4 (Dormand-Prince) or 3
  /// (Rosenbrock), for no evaluation more.
  void at(double t_s, Vector& x) const {
    assert(before_s_ <= t_s && t_s <= t_s_);
    method_.interpolate((t_s - before_s_) / (t_s_ - before_s_), x);
  }

  /// `DormandPrince::stiffness` of the last step taken.
  double stiffness() { return method_.stiffness(tolerance_); }

  const Work& work() const { return work_; }

 private:
  /// Where the second derivative is small against the first and both against the tolerance. Source: Hairer, Norsett
  /// and Wanner, Solving Ordinary Differential Equations I, 1993, section II.4.
  template <class F>
  double first_step(const F& f, double span_s) {
    const Vector& change = method_.derivative();
    const double size = in_tolerances(x_, x_, x_, tolerance_), slope = in_tolerances(change, x_, x_, tolerance_);
    double step_s = size < 1e-5 || slope < 1e-5 ? 1e-6 : 0.01 * size / slope;
    step_s = std::min(step_s, span_s);
    Vector moved = x_ + step_s * change, there = x_;
    evaluate(f, t_s_ + step_s, moved, there, work_);
    there -= change;
    const double bend = in_tolerances(there, x_, x_, tolerance_) / step_s;
    const double greater = std::max(slope, bend);
    const double by_order = std::isfinite(greater) && greater > 1e-15 ? power(0.01 / greater, 1.0 / Method::error_order)
                                                                      : std::max(1e-6, step_s * 1e-3);
    return std::min({100 * step_s, by_order, span_s});
  }

  Tolerance<Vector> tolerance_;
  StepLimits limits_;
  StepController controller_{Method::error_order};
  Method method_;
  Vector x_;
  double t_s_ = 0, before_s_ = 0;
  double next_s_ = 0;  // 0: none known
  std::int64_t attempts_ = 0;
  Work work_;
};

}  // namespace nadir::sim

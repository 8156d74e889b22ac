#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <variant>

#include "nadir/sim/adaptive.h"
#include "nadir/sim/dormand_prince.h"
#include "nadir/sim/rosenbrock.h"
#include "nadir/sim/step.h"

namespace nadir::sim {

/// What integrates an interval, and how finely.
struct Scheme {
  enum class Method { Euler, Midpoint, Heun, Rk4, DormandPrince, Rosenbrock };
  Method method = Method::Rk4;
  int steps = 1;         // of an interval, where they are fixed
  double tightness = 1;  // share of the tolerance that a step may err, where steps adapt
  friend bool operator==(const Scheme&, const Scheme&) = default;
};
std::string_view name_of(Scheme::Method method);
Result<Scheme::Method> parse_method(std::string_view text);
std::string to_string(const Scheme& scheme);
bool is_fixed(Scheme::Method method);
/// Of a method with fixed steps.
ExplicitMethod explicit_method(Scheme::Method method);

/// Integrates interval after interval by one scheme. Holds the space of that scheme alone.
template <class Vector>
class Integrator {
 public:
  /// `like`: any state of the size that is to come. `tolerance` is of the motion: the scheme's tightness is applied
  /// here.
  Integrator(const Scheme& scheme, const Vector& like, const Tolerance<Vector>& tolerance, StepLimits limits = {})
      : scheme_(scheme), engine_(engine(scheme, like, tolerance, limits)) {}

  /// `x` at `t_s` becomes the state at `end_s`. `f` may be another from interval to interval. Fails with time and state
  /// where the motion diverges or the tolerance cannot be met; `x` is that of the beginning then.
  template <class F>
  Result<void> advance(const F& f, double t_s, double end_s, Vector& x) {
    if (auto* fixed = std::get_if<Fixed>(&engine_)) {
      const double dt_s = (end_s - t_s) / scheme_.steps;
      fixed->x = x;
      for (int i = 0; i < scheme_.steps; ++i) {
        fixed->stepper.step(f, t_s + i * dt_s, fixed->x, dt_s, fixed->work);
        if (!fixed->x.allFinite()) return tl::unexpected(not_finite(fixed->x, t_s + (i + 1) * dt_s));
      }
      x = fixed->x;
      return {};
    }
    if (auto* explicit_steps = std::get_if<Adaptive<DormandPrince<Vector>>>(&engine_))
      return explicit_steps->advance(f, t_s, end_s, x);
    return std::get<Adaptive<Rosenbrock<Vector>>>(engine_).advance(f, t_s, end_s, x);
  }

  const Work& work() const {
    if (const auto* fixed = std::get_if<Fixed>(&engine_)) return fixed->work;
    if (const auto* steps = std::get_if<Adaptive<DormandPrince<Vector>>>(&engine_)) return steps->work();
    return std::get<Adaptive<Rosenbrock<Vector>>>(engine_).work();
  }
  const Scheme& scheme() const { return scheme_; }

 private:
  struct Fixed {
    ExplicitStepper<Vector> stepper;
    Vector x;
    Work work;
  };
  using Engine = std::variant<Fixed, Adaptive<DormandPrince<Vector>>, Adaptive<Rosenbrock<Vector>>>;

  static Engine engine(const Scheme& scheme, const Vector& like, const Tolerance<Vector>& tolerance,
                       const StepLimits& limits) {
    if (is_fixed(scheme.method)) return Fixed{{explicit_method(scheme.method), like}, like, {}};
    if (scheme.method == Scheme::Method::DormandPrince)
      return Adaptive<DormandPrince<Vector>>(tolerance.scaled(scheme.tightness), limits);
    return Adaptive<Rosenbrock<Vector>>(tolerance.scaled(scheme.tightness), limits);
  }

  Scheme scheme_;
  Engine engine_;
};

}  // namespace nadir::sim

#include "nadir/sim/step_control.h"

#include <fmt/format.h>

#include <cassert>

namespace nadir::sim {
namespace {

/// By the series of the inverse hyperbolic tangent on [sqrt(1/2), sqrt(2)): its argument is under 0.172, and the first
/// term left out under 1e-17.
double natural_log_of_mantissa(double mantissa) {
  const double z = (mantissa - 1) / (mantissa + 1), z2 = z * z;
  double sum = 0;
  for (int k = 21; k >= 1; k -= 2) sum = sum * z2 + 1.0 / k;
  return 2 * z * sum;
}

constexpr double ln2 = 0.69314718055994530942;

}  // namespace

double power(double base, double exponent) {
  assert(base > 0);
  int binary = 0;
  double mantissa = std::frexp(base, &binary);  // [1/2, 1), exact as ldexp is
  if (mantissa < 0.70710678118654752) {
    mantissa *= 2;
    --binary;
  }
  const double log2 = exponent * (binary + natural_log_of_mantissa(mantissa) / ln2);
  const double whole = std::floor(log2 + 0.5), rest = (log2 - whole) * ln2;  // |rest| <= 0.35
  double sum = 1;
  for (int k = 14; k >= 1; --k) sum = 1 + sum * rest / k;  // of the exponential; left out: under 1e-19
  return std::ldexp(sum, static_cast<int>(whole));
}

double StepController::after_taken(double error) {
  const double bounded = std::max(error, 1e-10);
  double factor = 0.9 * power(bounded, -0.7 / order_) * power(last_error_, 0.4 / order_);
  factor = std::clamp(factor, 0.2, 5.0);
  if (rejected_) factor = std::min(factor, 1.0);  // what has just failed is not tried again at once
  last_error_ = std::max(error, 1e-4);
  rejected_ = false;
  return factor;
}

double StepController::after_rejected(double error) {
  rejected_ = true;
  if (!std::isfinite(error)) return 0.1;
  return std::clamp(0.9 * power(error, -1 / order_), 0.1, 0.9);
}

Error stopped(std::string_view method, std::string_view why, double t_s, double step_s,
              const Eigen::Ref<const Eigen::VectorXd>& x) {
  std::string state;
  for (Eigen::Index i = 0; i < x.size() && i < 32; ++i) state += fmt::format("{}{:.6g}", i ? ", " : "", x[i]);
  if (x.size() > 32) state += ", ...";
  return {Error::Kind::Unsupported,
          fmt::format("{} stopped at t = {:.9g} s with a step of {:.3g} s: {}; the state is [{}]", method, t_s, step_s,
                      why, state)};
}

}  // namespace nadir::sim

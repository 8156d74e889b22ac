#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

#include "nadir/base/result.h"

namespace nadir::sim {

/// How far a component may err: `absolute` of its own (in its unit, > 0) and a share of its size.
template <class Vector>
struct Tolerance {
  Vector absolute;
  double relative = 0;

  static Tolerance same(const Vector& like, double absolute, double relative) {
    Vector all = like;
    all.setConstant(absolute);
    return {all, relative};
  }
  Tolerance scaled(double factor) const { return {factor * absolute, factor * relative}; }
};

/// Root mean square of the errors in tolerances: 1 is as far as it may err. Not finite where an error is not.
template <class Vector>
double in_tolerances(const Vector& error, const Vector& before, const Vector& after,
                     const Tolerance<Vector>& tolerance) {
  double sum = 0;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    const double share =
        error[i] / (tolerance.absolute[i] + tolerance.relative * std::max(std::abs(before[i]), std::abs(after[i])));
    sum += share * share;
  }
  return std::sqrt(sum / static_cast<double>(error.size()));
}

/// `base` to a power, `base` > 0, by our own arithmetic: a library's last digit, which differs between machines, would
/// decide where steps end. Error: relative, under 1e-12 while |exponent| <= 1; base and result in a double's normal
/// range.
double power(double base, double exponent);

struct StepLimits {
  double first_s = 0;  // the first step to try; 0: found from the derivative
  double least_s = 0;  // a shorter one fails; rounding of the time sets a limit in any case
  double most_s = std::numeric_limits<double>::infinity();
  std::int64_t most_steps = 1'000'000;  // with those rejected, of one interval
};

/// Next steps from errors, by proportion and integral: smoother than by the last error alone, and not led astray where
/// stability limits the step. Source: Hairer and Wanner, Solving Ordinary Differential Equations II, 1996, section
/// IV.2.
class StepController {
 public:
  /// `error_order`: the estimate of a step's error goes with the step to this power.
  explicit StepController(int error_order) : order_(error_order) {}
  /// Factor for the step after one that was taken. `error` in tolerances, [0, 1].
  double after_taken(double error);
  /// Factor for the same step tried again. `error` > 1; not finite where the attempt left the range of numbers.
  double after_rejected(double error);

 private:
  double order_;
  double last_error_ = 1e-4;
  bool rejected_ = false;
};

/// Why an adaptive integration cannot go on: a part of the message and where it was.
Error stopped(std::string_view method, std::string_view why, double t_s, double step_s,
              const Eigen::Ref<const Eigen::VectorXd>& x);

}  // namespace nadir::sim

#include "nadir/sim/lag.h"

#include <cassert>
#include <cmath>

namespace nadir::sim {

double followed_share(double time_constant_s, double duration_s) {
  assert(time_constant_s >= 0 && duration_s > 0);
  return -std::expm1(-duration_s / time_constant_s);  // of minus infinity where the output follows at once
}

FirstOrderLag::FirstOrderLag(double time_constant_s, double dt_s) : settled_(followed_share(time_constant_s, dt_s)) {
  const double d = dt_s / time_constant_s;
  if (d >= 1) {
    ramp_ = 1 - settled_ / d;
  } else {  // 1 - (1 - e^-d)/d = d/2! - d^2/3! + ...: the difference would lose digits
    double sum = 0;
    for (int k = 19; k >= 2; --k) sum = (1 - sum) * d / k;
    ramp_ = sum;
  }
}

SecondOrderLag::SecondOrderLag(double frequency_radps, double damping, double dt_s) {
  assert(frequency_radps > 0 && damping >= 0 && dt_s > 0);
  const double w = frequency_radps, sigma = damping * w;
  // e^(-sigma t) times cos or cosh, and times sin(r t)/r or sinh(r t)/r
  double even = 0, odd = 0;
  if (damping < 1) {
    const double r = w * std::sqrt((1 - damping) * (1 + damping)), decay = std::exp(-sigma * dt_s);
    even = decay * std::cos(r * dt_s);
    odd = r > 0 ? decay * std::sin(r * dt_s) / r : decay * dt_s;
  } else {
    const double r = w * std::sqrt((damping - 1) * (damping + 1));
    const double slow = std::exp(-w * w / (sigma + r) * dt_s);  // the slower root without a difference
    const double gone = -std::expm1(-2 * r * dt_s);
    even = slow * (1 - 0.5 * gone);
    odd = r > 0 ? slow * gone / (2 * r) : slow * dt_s;
  }
  value_from_value_ = even + sigma * odd;
  value_from_rate_ = odd;
  rate_from_value_ = -w * w * odd;
  rate_from_rate_ = even - sigma * odd;

  if (w * dt_s * (1 + damping) > 1) {
    const double late = 2 * damping / w, slope = 1 / dt_s;  // a ramp is followed so much later in the end
    ramp_value_ = 1 - late * slope + value_from_value_ * late * slope - value_from_rate_ * slope;
    ramp_rate_ = slope + rate_from_value_ * late * slope - rate_from_rate_ * slope;
  } else {  // those terms cancel for short steps: the series of the response, its terms from the equation itself
    const double a = 2 * sigma * dt_s, b = w * w * dt_s * dt_s;
    double before = 0, term = b / 6;  // of (t/dt)^2 and (t/dt)^3
    ramp_value_ = term;
    ramp_rate_ = 3 * term / dt_s;
    for (int k = 2; k < 26; ++k) {
      const double next = (-a * (k + 1) * term - b * before) / ((k + 2) * (k + 1));
      before = term;
      term = next;
      ramp_value_ += term;
      ramp_rate_ += (k + 2) * term / dt_s;
    }
  }
}

}  // namespace nadir::sim

#pragma once

#include <cmath>

#include "nadir/sim/derivative.h"

namespace nadir::sim {

/// Greatest absolute value of an eigenvalue of the Jacobian at a state, 1/s, by power iteration with differences: no
/// matrix. Times a step it says whether an explicit method is stable. At most 65 evaluations. Error: a few per cent
/// where one eigenvalue or one complex pair is the largest; where several are about as large, their mean growth. NaN
/// where the derivative is not finite.
template <class F, class Vector>
double spectral_radius(const F& f, double t_s, const Vector& x, Work& work) {
  Vector change = x, there = x, moved = x, size = x, direction = x;
  evaluate(f, t_s, x, change, work);
  // Components are told apart by size, since metres from the Earth's centre stand beside radians
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    size[i] = std::max(std::abs(x[i]), 1e-3);
    direction[i] = 1 + 0.25 * static_cast<double>(i % 3);  // along no eigenvector of a system written by hand
  }
  direction.normalize();
  double before = 0;
  for (int block = 0; block < 8; ++block) {
    double growth = 1;  // of eight iterations: a complex pair makes single ones waver
    for (int i = 0; i < 8; ++i) {
      moved = x + 0x1p-26 * size.cwiseProduct(direction);
      evaluate(f, t_s, moved, there, work);
      direction = (there - change).cwiseQuotient(size) * 0x1p26;
      const double length = direction.norm();
      if (!(length > 0)) return length;
      growth *= length / 0x1p10;  // eight of 1e6 still fit many times
      direction /= length;
    }
    const double mean = 0x1p10 * std::sqrt(std::sqrt(std::sqrt(growth)));
    if (!std::isfinite(mean) || std::abs(mean - before) < 0.01 * mean) return mean;
    before = mean;
  }
  return before;
}

}  // namespace nadir::sim

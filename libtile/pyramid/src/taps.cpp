#include "taps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace nadir::pyramid {
namespace {

/// The finer sample in which a coarser one's centre lies; the earlier of two where it lies between them.
std::int32_t nearest(std::int32_t fine, std::int32_t coarse, std::int32_t i) {
  const std::int64_t twice = (2 * std::int64_t{i} + 1) * fine;
  return static_cast<std::int32_t>((twice + 2 * std::int64_t{coarse} - 1) / (2 * std::int64_t{coarse}) - 1);
}

Taps box(std::int32_t fine, std::int32_t coarse, std::int32_t i) {
  // In units of 1 / coarse of a finer sample both kinds of borders are whole numbers.
  const std::int64_t begin = std::int64_t{i} * fine, end = begin + fine;
  Taps taps{static_cast<std::int32_t>(begin / coarse), {}};
  for (std::int64_t j = taps.first; j * coarse < end; ++j)
    taps.weights.push_back(static_cast<double>(std::min((j + 1) * coarse, end) - std::max(j * coarse, begin)) /
                           static_cast<double>(fine));
  return taps;
}

/// `kernel`: over distances in coarser samples, 0 beyond `radius`.
template <class Kernel>
Taps weighted(std::int32_t fine, std::int32_t coarse, std::int32_t i, double radius, Kernel&& kernel) {
  const double step = static_cast<double>(fine) / coarse, centre = (i + 0.5) * step;
  const auto first = std::max(0, static_cast<std::int32_t>(std::ceil(centre - radius * step - 0.5)));
  const auto last = std::min(fine - 1, static_cast<std::int32_t>(std::floor(centre + radius * step - 0.5)));
  Taps taps{first, {}};
  double sum = 0;
  for (std::int32_t j = first; j <= last; ++j) {
    taps.weights.push_back(kernel((j + 0.5 - centre) / step));
    sum += taps.weights.back();
  }
  for (double& weight : taps.weights) weight /= sum;
  return taps;
}

/// sin(pi x) by its series after reduction, so that weights do not depend on the mathematics library.
double sine_of_pi(double x) {
  const double whole = std::nearbyint(x), r = (x - whole) * std::numbers::pi, r2 = r * r;
  double term = r, sum = r;
  for (int k = 1; k < 12; ++k) {
    term *= -r2 / ((2 * k) * (2 * k + 1));
    sum += term;
  }
  return std::fmod(whole, 2) == 0 ? sum : -sum;
}

double lanczos3(double x) {
  if (std::abs(x) < 1e-9) return 1;
  if (std::abs(x) >= 3) return 0;
  const double pi_x = std::numbers::pi * x;
  return 3 * sine_of_pi(x) * sine_of_pi(x / 3) / (pi_x * pi_x);
}

/// exp(-2 x^2): standard deviation of half a coarser sample; by halving, squaring and a series.
double gaussian(double x) {
  const double e = -2 * x * x / 256;
  double term = 1, sum = 1;
  for (int k = 1; k < 10; ++k) {
    term *= e / k;
    sum += term;
  }
  for (int k = 0; k < 8; ++k) sum *= sum;
  return sum;
}

/// Whether the taps behind `before` lie, as these do, off the edges of a level that is halved exactly: they have the
/// same weights, two samples on.
bool repeats(const Taps& before, std::int32_t fine, std::int32_t coarse, std::size_t all_taps) {
  return std::int64_t{fine} == 2 * std::int64_t{coarse} && before.weights.size() == all_taps &&
         std::int64_t{before.first} + 2 + static_cast<std::int64_t>(all_taps) <= fine;
}

}  // namespace

std::vector<Taps> taps(Filter filter, std::int32_t fine, std::int32_t coarse, std::int32_t begin, std::int32_t end) {
  std::vector<Taps> all;
  all.reserve(static_cast<std::size_t>(end - begin));
  for (std::int32_t i = begin; i < end; ++i) {
    switch (filter) {
      case Filter::Nearest:
        all.push_back({nearest(fine, coarse, i), {1.0}});
        break;
      case Filter::Gaussian:
        all.push_back(!all.empty() && repeats(all.back(), fine, coarse, 6)
                          ? Taps{all.back().first + 2, all.back().weights}
                          : weighted(fine, coarse, i, 1.5, gaussian));
        break;
      case Filter::Lanczos:
        all.push_back(!all.empty() && repeats(all.back(), fine, coarse, 12)
                          ? Taps{all.back().first + 2, all.back().weights}
                          : weighted(fine, coarse, i, 3, lanczos3));
        break;
      case Filter::Box:
      case Filter::Mode:
        all.push_back(box(fine, coarse, i));
        break;
    }
  }
  return all;
}

}  // namespace nadir::pyramid

#include "nadir/bench/statistics.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>

namespace nadir::bench {

double quantile(std::vector<double> values, double q) {
  assert(!values.empty() && q >= 0 && q <= 1);
  std::sort(values.begin(), values.end());
  const double rank = q * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(rank);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (rank - static_cast<double>(below)) * (values[above] - values[below]);
}

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

double paired_ratio(std::span<const double> a, std::span<const double> b) {
  assert(a.size() == b.size());
  std::vector<double> ratios(a.size());
  std::transform(a.begin(), a.end(), b.begin(), ratios.begin(), std::divides<>());
  return median(std::move(ratios));
}

std::vector<std::size_t> pareto_front(std::span<const double> cost, std::span<const double> error) {
  assert(cost.size() == error.size());
  std::vector<std::size_t> order(cost.size()), front;
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t i, std::size_t j) { return std::pair(cost[i], error[i]) < std::pair(cost[j], error[j]); });
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    if (error[i] >= least) continue;
    least = error[i];
    front.push_back(i);
  }
  return front;
}

}  // namespace nadir::bench

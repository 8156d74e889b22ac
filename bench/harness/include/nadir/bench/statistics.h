#pragma once

#include <span>
#include <vector>

namespace nadir::bench {

/// The value below which a fraction `q` in [0, 1] of `values` lies, by linear interpolation between the two nearest
/// ranks (Hyndman and Fan, Sample Quantiles in Statistical Packages, 1996, definition 7). At least one value.
double quantile(std::vector<double> values, double q);

double median(std::vector<double> values);

/// Median over rounds of a[i] / b[i]: what both suffered in a round, such as a slower clock, cancels.
/// As many of both, at least one, b > 0.
double paired_ratio(std::span<const double> a, std::span<const double> b);

/// Places in `cost` and `error` (as many of both) of the points that none other beats in one without losing in the
/// other, by growing cost.
std::vector<std::size_t> pareto_front(std::span<const double> cost, std::span<const double> error);

}  // namespace nadir::bench

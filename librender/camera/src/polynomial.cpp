#include "polynomial.h"

#include <cmath>
#include <cstddef>

namespace nadir::render {
namespace {

std::vector<double> derivative(const std::vector<double>& polynomial) {
  std::vector<double> slope;
  for (std::size_t i = 1; i < polynomial.size(); ++i) slope.push_back(static_cast<double>(i) * polynomial[i]);
  return slope;
}

/// The last place before it changes its sign, between two places of different signs.
double bisect(const std::vector<double>& polynomial, double low, double high) {
  const bool negative = value(polynomial, low) < 0;
  for (int i = 0; i < 200; ++i) {
    const double middle = low + (high - low) / 2;
    if (middle <= low || middle >= high) break;
    ((value(polynomial, middle) < 0) == negative ? low : high) = middle;
  }
  return low;
}

/// All places in (0, end] where it changes its sign, in order.
std::vector<double> sign_changes(const std::vector<double>& polynomial, double end) {
  if (polynomial.size() < 2) return {};
  std::vector<double> borders = sign_changes(derivative(polynomial), end);
  borders.push_back(end);
  std::vector<double> found;
  double low = 0;
  for (const double high : borders) {
    const double at_low = value(polynomial, low), at_high = value(polynomial, high);
    if ((at_low < 0 && at_high > 0) || (at_low > 0 && at_high < 0)) found.push_back(bisect(polynomial, low, high));
    low = high;
  }
  return found;
}

}  // namespace

double value(const std::vector<double>& polynomial, double x) {
  double sum = 0;
  for (std::size_t i = polynomial.size(); i-- > 0;) sum = sum * x + polynomial[i];
  return sum;
}

std::optional<double> least_sign_change(const std::vector<double>& polynomial, double end) {
  const std::vector<double> all = sign_changes(polynomial, end);
  if (all.empty()) return std::nullopt;
  return all.front();
}

}  // namespace nadir::render

#pragma once

#include <optional>
#include <vector>

namespace nadir::render {

/// The last place in [0, end] before a polynomial changes its sign for the first time; coefficients from the constant
/// term on.
/// Roots of its derivative divide the interval into parts with one root at most, which bisection finds: to the last
/// digit, whatever the coefficients. Source: Rolle's theorem.
std::optional<double> least_sign_change(const std::vector<double>& polynomial, double end);

double value(const std::vector<double>& polynomial, double x);

}  // namespace nadir::render

#pragma once

#include <array>

namespace nadir::sim {

/// Van der Pol's oscillator of `problems.h` from (2, -0.66) at 0 by Boost.odeint's Rosenbrock method at 1e-12.
std::array<double, 2> van_der_pol_by_odeint(double eps, double end_s);

}  // namespace nadir::sim

// Compiled as C++17: uBLAS of Boost before 1.77 does not compile as C++20.
#include "odeint_stiff.h"

#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/rosenbrock4.hpp>
#include <boost/numeric/odeint/stepper/rosenbrock4_controller.hpp>
#include <utility>

namespace nadir::sim {

std::array<double, 2> van_der_pol_by_odeint(double eps, double end_s) {
  namespace odeint = boost::numeric::odeint;
  using Vector = boost::numeric::ublas::vector<double>;
  using Matrix = boost::numeric::ublas::matrix<double>;
  const auto f = [=](const Vector& y, Vector& change, double) {
    change[0] = y[1];
    change[1] = ((1 - y[0] * y[0]) * y[1] - y[0]) / eps;
  };
  const auto slopes = [=](const Vector& y, Matrix& j, double, Vector& with_time) {
    j(0, 0) = 0;
    j(0, 1) = 1;
    j(1, 0) = (-2 * y[0] * y[1] - 1) / eps;
    j(1, 1) = (1 - y[0] * y[0]) / eps;
    with_time[0] = with_time[1] = 0;
  };
  Vector y(2);
  y[0] = 2;
  y[1] = -0.66;
  odeint::integrate_adaptive(odeint::make_controlled<odeint::rosenbrock4<double>>(1e-12, 1e-12), std::pair(f, slopes),
                             y, 0.0, end_s, 1e-6);
  return {y[0], y[1]};
}

}  // namespace nadir::sim

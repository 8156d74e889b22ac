#include "nadir/sim/lag.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace nadir::sim {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// e^A v in extended precision, by the series of A/2^20 squared back: independent of closed forms. Inputs as further
/// components of the state make it exact for held and linear ones.
template <int n>
Eigen::Matrix<long double, n, 1> exponential(const Eigen::Matrix<long double, n, n>& a,
                                             const Eigen::Matrix<long double, n, 1>& v) {
  using Matrix = Eigen::Matrix<long double, n, n>;
  const Matrix small = a / 1048576.0L;
  Matrix term = small, sum = small;  // e^A - 1, so that squaring loses no digits
  for (int k = 2; k < 16; ++k) sum += term = (term * small / k).eval();
  for (int i = 0; i < 20; ++i) sum = (2 * sum + sum * sum).eval();
  return v + sum * v;
}

TEST(FirstOrderLag, IsExactToRoundingForHeldAndLinearInputs) {
  for (const double d : {1e-9, 1e-4, 0.1, 0.999, 1.0, 1.001, 5.0, 50.0}) {
    const double tau = 0.02, dt = d * tau;
    const FirstOrderLag lag(tau, dt);
    // x, input, slope of the input
    Eigen::Matrix<long double, 3, 3> a;
    a << -dt / tau, dt / tau, 0, 0, 0, 1, 0, 0, 0;
    const double x = 0.3, from = -1.2, to = 0.9;
    EXPECT_NEAR(lag.held(x, from), static_cast<double>(exponential<3>(a, {x, from, 0})[0]), 4 * epsilon) << d;
    EXPECT_NEAR(lag.linear(x, from, to),
                static_cast<double>(exponential<3>(a, {x, from, static_cast<long double>(to) - from})[0]), 8 * epsilon)
        << d;
    // What a ramp from rest does in a short step is small, and has all its digits
    const double ramp = static_cast<double>(exponential<3>(a, {0, 0, 1})[0]);
    EXPECT_NEAR(lag.linear(0, 0, 1), ramp, 8 * epsilon * ramp) << d;
  }
}

TEST(FirstOrderLag, FollowsAtOnceWithoutATimeConstant) {
  const FirstOrderLag lag(0, 0.01);
  EXPECT_EQ(lag.held(5, 2), 2);
  EXPECT_EQ(lag.linear(5, 2, 3), 3);
}

TEST(SecondOrderLag, IsExactToRoundingForAnyDampingAndStep) {
  for (const double damping : {0.0, 0.05, 0.7, 0.999999, 1.0, 1.000001, 1.5, 20.0})
    for (const double wt : {1e-6, 1e-2, 0.3, 0.49, 0.51, 1.0, 3.0, 20.0}) {
      const double w = 40, dt = wt / w;
      const SecondOrderLag lag(w, damping, dt);
      // x, x'/w, input, slope of the input: time in steps
      Eigen::Matrix<long double, 4, 4> a;
      const long double b = static_cast<long double>(w) * dt;
      a << 0, b, 0, 0, -b, -2 * b * damping, b, 0, 0, 0, 0, 1, 0, 0, 0, 0;
      const auto expect = [&](const SecondOrderLag::State& found, const Eigen::Matrix<long double, 4, 1>& start) {
        const auto exact = exponential<4>(a, start);
        // An angle of w t is rounded before its sine, and terms up to 2 z cancel
        const double bound = 8 * epsilon * (1 + wt + 2 * damping);
        EXPECT_NEAR(found.value, static_cast<double>(exact[0]), bound) << damping << ' ' << wt;
        EXPECT_NEAR(found.rate_per_s / w, static_cast<double>(exact[1]), bound) << damping << ' ' << wt;
      };
      expect(lag.held({0.4, 0.2 * w}, -0.7), {0.4L, static_cast<long double>(0.2 * w) / w, -0.7, 0});
      expect(lag.linear({0.4, 0.2 * w}, -0.7, 0.3),
             {0.4L, static_cast<long double>(0.2 * w) / w, -0.7, static_cast<long double>(0.3) - -0.7});
      const auto ramp = exponential<4>(a, {0, 0, 0, 1});
      if (wt < 0.4 && damping < 1.2) {
        EXPECT_NEAR(lag.linear({}, 0, 1).value, static_cast<double>(ramp[0]),
                    64 * epsilon * static_cast<double>(ramp[0]))
            << "small, with all its digits: " << damping << ' ' << wt;
      }
    }
}

TEST(SecondOrderLag, SettlesInOneStepHoweverLong) {
  for (const double damping : {0.3, 1.0, 30.0}) {
    const SecondOrderLag lag(1e5, damping, 1e3);
    const auto end = lag.held({1e3, -1e6}, 2);
    EXPECT_EQ(end.value, 2);
    EXPECT_EQ(end.rate_per_s, 0);
  }
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/sim/step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace nadir::sim {
namespace {
using Eigen::Vector2d, Eigen::Vector4d;

/// Error after one second of x'' = -x cos(t)-like motion with a known answer: x = exp(sin 3t), x' = 3 cos(3t) x, which
/// depends on time and on the state.
double error_of(int steps) {
  const auto derivative = [](double t, const Eigen::Matrix<double, 1, 1>& x) -> Eigen::Matrix<double, 1, 1> {
    return 3 * std::cos(3 * t) * x;
  };
  Eigen::Matrix<double, 1, 1> x(1.0);
  const double dt = 1.0 / steps;
  for (int i = 0; i < steps; ++i) x = rk4_step(derivative, i * dt, x, dt);
  return std::abs(x[0] - std::exp(std::sin(3.0)));
}

TEST(Rk4Step, HalvingTheStepDividesTheErrorBySixteen) {
  // Order 4: the ratio tends to 16, and differs from it by the next term, in proportion to the step.
  for (const int steps : {64, 128, 256}) {
    const double ratio = error_of(steps) / error_of(2 * steps);
    EXPECT_NEAR(ratio, 16, 16 * 10.0 / steps) << steps << " steps";
  }
  EXPECT_GT(error_of(512), 1e-13) << "rounding would hide the order";
}

TEST(Rk4Step, IsExactForACubicInTime) {
  const auto derivative = [](double t, const Vector2d&) { return Vector2d(4 * t * t * t, 3 * t * t - 2 * t); };
  const Vector2d x =
      rk4_step(derivative, 0.5, Vector2d(0.0625, -0.125), 1.5);  // from t = 0.5 to t = 2: t^4 and t^3 - t^2
  EXPECT_NEAR(x[0], 16, 1e-14);
  EXPECT_NEAR(x[1], 4, 1e-14);
}

TEST(Rk4Step, LosesTheEnergyOfAnOscillatorAtItsKnownRate) {
  // The method multiplies the squared amplitude of x'' = -w^2 x by 1 - (w dt)^6/72 + (w dt)^8/576 a step.
  const double dt = 0.1;
  const auto derivative = [](double, const Vector2d& x) { return Vector2d(x[1], -x[0]); };
  Vector2d x(1, 0);
  const int steps = 10000;
  for (int i = 0; i < steps; ++i) x = rk4_step(derivative, i * dt, x, dt);
  const double per_step = 1 - std::pow(dt, 6) / 72 + std::pow(dt, 8) / 576;
  EXPECT_NEAR(x.squaredNorm(), std::pow(per_step, steps), steps * 4 * std::numeric_limits<double>::epsilon());
  EXPECT_LT(x.squaredNorm(), 1 - 1e-5) << "the loss is larger than rounding";
}

TEST(RenormaliseQuaternion, KeepsTheDirectionAndMakesTheLengthOne) {
  Eigen::Matrix<double, 6, 1> x;
  x << 7, 0.2, -0.4, 0.6, 0.8, 9;
  const Vector4d before = x.segment<4>(1);
  renormalise_quaternion(x, 1);
  EXPECT_NEAR((x.segment<4>(1) - before.normalized()).norm(), 0, 1e-15);
  EXPECT_EQ(x[0], 7);
  EXPECT_EQ(x[5], 9);
}

TEST(FiniteOrError, NamesTheTimeAndTheComponentThatDiverged) {
  Vector4d x(1, 2, 3, 4);
  ASSERT_TRUE(finite_or_error(x, 1.0));
  for (const double bad : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    for (int i = 0; i < 4; ++i) {
      Vector4d y = x;
      y[i] = bad;
      const auto result = finite_or_error(y, 12.5);
      ASSERT_FALSE(result);
      EXPECT_NE(result.error().message.find("t = 12.5 s: component " + std::to_string(i)), std::string::npos)
          << result.error().message;
    }
}

}  // namespace
}  // namespace nadir::sim

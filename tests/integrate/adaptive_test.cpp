#include "nadir/sim/adaptive.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "nadir/sim/dormand_prince.h"
#include "nadir/sim/rosenbrock.h"
#include "nadir/sim/step.h"
#include "problems.h"

namespace nadir::sim {
namespace {
using Eigen::Vector2d, Eigen::Vector4d;
using One = Breathing::Vector;
constexpr double pi = std::numbers::pi;

template <class Vector>
Tolerance<Vector> tolerance(const Vector& like, double absolute, double relative = 0) {
  return Tolerance<Vector>::same(like, absolute, relative);
}

/// Error after a second of `steps` equal steps of an adaptive method: any error is tolerated.
template <template <class> class Method>
double error_of(int steps) {
  const double h = 1.0 / steps;
  Adaptive<Method<One>> method(tolerance(One(1), 1e9), {.first_s = h, .most_s = h});
  One x(1);
  EXPECT_TRUE(method.advance(Breathing{}, 0, 1, x));
  EXPECT_EQ(method.work().steps, steps);
  return std::abs(x[0] - Breathing::at(1));
}

/// The greatest error of the interpolation within those steps.
template <template <class> class Method>
double error_within(int steps) {
  const double h = 1.0 / steps;
  Adaptive<Method<One>> method(tolerance(One(1), 1e9), {.first_s = h, .most_s = h});
  EXPECT_TRUE(method.start(Breathing{}, 0, One(1)));
  double worst = 0;
  while (method.time_s() < 1) {
    EXPECT_TRUE(method.step(Breathing{}, 1));
    for (const double share : {0.0, 0.2, 0.5, 0.7, 1.0}) {
      const double t = method.before_s() + share * (method.time_s() - method.before_s());
      One x;
      method.at(std::min(t, method.time_s()), x);
      worst = std::max(worst, std::abs(x[0] - Breathing::at(t)));
    }
  }
  return worst;
}

TEST(FixedSteps, ConvergeWithTheOrderOfTheirMethod) {
  for (const auto& [method, order] : {std::pair{ExplicitMethod::Euler, 1}, std::pair{ExplicitMethod::Midpoint, 2},
                                      std::pair{ExplicitMethod::Heun, 2}, std::pair{ExplicitMethod::Rk4, 4}}) {
    const auto error = [&, m = method](int steps) {
      ExplicitStepper<One> stepper(m, One(1));
      One x(1);
      Work work;
      for (int i = 0; i < steps; ++i) stepper.step(Breathing{}, 1.0 * i / steps, x, 1.0 / steps, work);
      EXPECT_EQ(work.evaluations, steps * stages_of(m));
      return std::abs(x[0] - Breathing::at(1));
    };
    // The ratio tends to 2^order and differs from it in proportion to the step
    EXPECT_NEAR(std::log2(error(256) / error(512)), order, 0.1) << "method " << static_cast<int>(method);
    EXPECT_GT(error(512), 1e-13) << "rounding would hide the order";
  }
}

TEST(DormandPrince, ConvergesWithTheFifthOrder) {
  EXPECT_NEAR(std::log2(error_of<DormandPrince>(32) / error_of<DormandPrince>(64)), 5, 0.3);
  EXPECT_GT(error_of<DormandPrince>(64), 1e-13) << "rounding would hide the order";
}

/// x' = -x^2 - y/3, y' = x y, with slopes of its own: differences would hide the order in their noise.
struct Curved {
  static constexpr bool autonomous = true;
  Vector2d operator()(double, const Vector2d& x) const { return {-x[0] * x[0] - x[1] / 3, x[0] * x[1]}; }
  void jacobian(double, const Vector2d& x, Eigen::Matrix2d& slopes) const { slopes << -2 * x[0], -1.0 / 3, x[1], x[0]; }
};

TEST(Rosenbrock, ConvergesWithTheFourthOrder) {
  const auto end = [](int steps) {
    const double h = 2.0 / steps;
    Adaptive<Rosenbrock<Vector2d>> method(tolerance(Vector2d(0, 0), 1e9), {.first_s = h, .most_s = h});
    Vector2d x(2, 1);
    EXPECT_TRUE(method.advance(Curved{}, 0, 2, x));
    return x;
  };
  const Vector2d exact = end(4096);
  const auto error = [&](int steps) { return (end(steps) - exact).norm(); };
  EXPECT_NEAR(std::log2(error(128) / error(256)), 4, 0.1);
  EXPECT_GT(error(256), 1e-12) << "rounding would hide the order";
  // Where the derivative depends on time, its terms keep the order: with one wrong it is 1. This problem has one more.
  EXPECT_GT(std::log2(error_of<Rosenbrock>(32) / error_of<Rosenbrock>(64)), 3.7);
}

TEST(DenseOutput, ConvergesWithItsOwnOrderAndMeetsTheEndsOfTheStep) {
  // Interpolation of order p errs by O(h^(p+1)) within a step: 5 and 4, whatever the steps' ends do.
  EXPECT_NEAR(std::log2(error_within<DormandPrince>(32) / error_within<DormandPrince>(64)), 5, 0.4);
  EXPECT_NEAR(std::log2(error_within<Rosenbrock>(32) / error_within<Rosenbrock>(64)), 4, 0.4);
  Adaptive<DormandPrince<One>> method(tolerance(One(1), 1e-6));
  ASSERT_TRUE(method.start(Breathing{}, 0, One(1)));
  ASSERT_TRUE(method.step(Breathing{}, 1));
  One x;
  method.at(0, x);
  EXPECT_EQ(x[0], 1);
  method.at(method.time_s(), x);
  EXPECT_NEAR(x[0], method.state()[0], 1e-15);
}

TEST(DormandPrince, TakesSixEvaluationsAStepAndOneAStart) {
  Adaptive<DormandPrince<One>> method(tolerance(One(1), 1e-8), {.first_s = 0.01});
  One x(1);
  ASSERT_TRUE(method.advance(Breathing{}, 0, 3, x));
  const Work& work = method.work();
  EXPECT_EQ(work.evaluations, 1 + 6 * (work.steps + work.rejected));
  EXPECT_EQ(work.jacobians + work.factorisations + work.solves, 0);
}

TEST(Adaptive, ErrorsFollowTheTolerance) {
  double before = 0;
  for (const double asked : {1e-4, 1e-6, 1e-8, 1e-10}) {
    Adaptive<DormandPrince<Vector4d>> method(tolerance(Vector4d(0, 0, 0, 0), asked));
    Vector4d x = Kepler::start(0.6);
    ASSERT_TRUE(method.advance(Kepler{}, 0, 2 * pi, x));
    const double error = (x - Kepler::start(0.6)).norm();
    EXPECT_LT(error, 100 * asked) << "a turn lets errors grow with the time that they have";
    EXPECT_GT(error, asked / 100);
    if (before > 0) {
      EXPECT_NEAR(std::log10(before / error), 2, 1);
    }
    before = error;
  }
}

TEST(Adaptive, KeepsTheEnergyOfAnOrbitWithinTheTolerance) {
  Adaptive<DormandPrince<Vector4d>> method(tolerance(Vector4d(0, 0, 0, 0), 1e-11));
  Vector4d x = Kepler::start(0.9);
  const double energy = Kepler::energy(x);
  double least = 1, most = 0;  // step
  for (int turn = 0; turn < 10; ++turn) {
    ASSERT_TRUE(method.start(Kepler{}, 2 * pi * turn, x));
    while (method.time_s() < 2 * pi * (turn + 1)) {
      ASSERT_TRUE(method.step(Kepler{}, 2 * pi * (turn + 1)));
      least = std::min(least, method.time_s() - method.before_s());
      most = std::max(most, method.time_s() - method.before_s());
    }
    x = method.state();
  }
  EXPECT_NEAR(Kepler::energy(x), energy, 2e-8);
  EXPECT_GT(most, 30 * least) << "an orbit as narrow as this exercises the choice of steps";
}

TEST(Adaptive, KeepsTheLengthOfAQuaternion) {
  using Quaternion = Vector4d;  // x y z w, turning about a moving axis
  const auto turn = [](double t, const Quaternion& q) -> Quaternion {
    const double p = std::cos(t), r = 2 * std::sin(0.7 * t), s = 1.5;
    return 0.5 * Quaternion(p * q[3] + s * q[1] - r * q[2], r * q[3] - s * q[0] + p * q[2],
                            s * q[3] + r * q[0] - p * q[1], -p * q[0] - r * q[1] - s * q[2]);
  };
  Adaptive<DormandPrince<Quaternion>> method(tolerance(Quaternion(0, 0, 0, 1), 1e-10));
  Quaternion q(0, 0, 0, 1);
  ASSERT_TRUE(method.advance(turn, 0, 100, q));
  EXPECT_NEAR(q.norm(), 1, static_cast<double>(method.work().steps) * 1e-10);
  EXPECT_NE(q.norm(), 1) << "it is kept by the method's order, not by scaling";
}

TEST(Adaptive, StatesOfDynamicSizeGiveTheSameBits) {
  Adaptive<DormandPrince<Vector4d>> fixed(tolerance(Vector4d(0, 0, 0, 0), 1e-9));
  Adaptive<DormandPrince<Eigen::VectorXd>> dynamic(tolerance(Eigen::VectorXd(Eigen::VectorXd::Zero(4)), 1e-9));
  Vector4d x = Kepler::start(0.5);
  Eigen::VectorXd y = x;
  ASSERT_TRUE(fixed.advance(Kepler{}, 0, 10, x));
  const auto kepler = [](double t, const Eigen::VectorXd& s, Eigen::VectorXd& change) {
    change = Kepler{}(t, Vector4d(s));
  };
  ASSERT_TRUE(dynamic.advance(kepler, 0, 10, y));
  EXPECT_EQ((y - x).norm(), 0);
  EXPECT_EQ(fixed.work(), dynamic.work());
}

TEST(Adaptive, IntervalsBeginWithTheInputOfTheirOwn) {
  // A lag whose input jumps at each interval: what was computed at the end of the last one must not be used again.
  Adaptive<DormandPrince<One>> method(tolerance(One(1), 1e-10));
  One x(0);
  double exact = 0;
  for (int i = 0; i < 50; ++i) {
    const double input = i % 2 ? 1 : -3;
    ASSERT_TRUE(method.advance([=](double, const One& s) { return One(input - s[0]); }, 0.1 * i, 0.1 * (i + 1), x));
    exact = input + (exact - input) * std::exp(-0.1);
  }
  EXPECT_NEAR(x[0], exact, 1e-9);
}

TEST(Adaptive, ATinyIntervalDoesNotShortenTheNextSteps) {
  Adaptive<DormandPrince<One>> whole(tolerance(One(1), 1e-8)), cut(tolerance(One(1), 1e-8));
  One x(1), y(1);
  ASSERT_TRUE(whole.advance(Breathing{}, 0, 3, x));
  ASSERT_TRUE(cut.advance(Breathing{}, 0, 1, y));
  ASSERT_TRUE(cut.advance(Breathing{}, 1, 1 + 1e-9, y));
  ASSERT_TRUE(cut.advance(Breathing{}, 1 + 1e-9, 3, y));
  EXPECT_LT(cut.work().evaluations, whole.work().evaluations + 60);
}

// -- what fails, says when and where ----------------------------------------------------------------------------------

template <class Method>
void expect_end(Adaptive<Method> method, const auto& f, double start, double end, const char* what, double where) {
  typename Method::Vector x = Method::Vector::Constant(start);
  const auto before = x;
  const auto done = method.advance(f, 0, end, x);
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().message.find(what), std::string::npos) << done.error().message;
  EXPECT_NE(done.error().message.find("the state is ["), std::string::npos) << done.error().message;
  EXPECT_NEAR(method.time_s(), where, 1e-3) << done.error().message;
  EXPECT_TRUE(method.state().allFinite());
  EXPECT_EQ(x, before);
}

TEST(Adaptive, AMotionThatRunsAwayEndsWithItsTimeAndState) {
  const auto explode = [](double, const One& x) { return One(x[0] * x[0]); };  // 1/(1 - t)
  expect_end(Adaptive<DormandPrince<One>>(tolerance(One(1), 1e-6, 1e-6)), explode, 1, 2, "step", 1);
  expect_end(Adaptive<Rosenbrock<One>>(tolerance(One(1), 1e-6, 1e-6)), explode, 1, 2, "step", 1);
}

TEST(Adaptive, ADerivativeThatIsNotANumberEndsWithItsTimeAndState) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const auto late = [=](double t, const One&) { return One(t > 0.5 ? nan : 1.0); };
  expect_end(Adaptive<DormandPrince<One>>(tolerance(One(1), 1e-6)), late, 0, 1, "diverges", 0.5);
  expect_end(Adaptive<Rosenbrock<One>>(tolerance(One(1), 1e-6)), late, 0, 1, "diverges", 0.5);
  const auto never = [=](double, const One&) { return One(nan); };
  expect_end(Adaptive<DormandPrince<One>>(tolerance(One(1), 1e-6)), never, 0, 1, "not finite", 0);
  expect_end(Adaptive<Rosenbrock<One>>(tolerance(One(1), 1e-6)), never, 0, 1, "not finite", 0);
}

TEST(Adaptive, StepsThatBecomeTooShortOrTooManyAreSaid) {
  expect_end(Adaptive<DormandPrince<One>>(tolerance(One(1), 1e-10), {.first_s = 0.5, .least_s = 0.1}), Breathing{}, 1,
             1, "no step is short enough", 0);
  const auto stiff = [](double, const One& x) { return One(-1e6 * x[0]); };
  expect_end(Adaptive<DormandPrince<One>>(tolerance(One(1), 1e-3), {.most_steps = 100}), stiff, 1, 100,
             "an L-stable method", 0);
}

TEST(Adaptive, AJumpOfTheDerivativeWithinAStepIsPassedWithAHundredTolerances) {
  // Weights of the method's error estimate sum to 0.003 where those of the step sum to 0.2: a jump can err by 70 times
  // what is estimated. Inputs that jump belong on the end of an interval.
  const auto jump = [](double t, const One&) { return One(t < 1.0 / 3 ? 0.0 : 1.0); };
  for (const double asked : {1e-3, 1e-6, 1e-9}) {
    Adaptive<DormandPrince<One>> method(tolerance(One(1), asked));
    One x(0);
    ASSERT_TRUE(method.advance(jump, 0, 1, x));
    EXPECT_NEAR(x[0], 2.0 / 3, 100 * asked);
  }
}

TEST(Power, AgreesWithTheLibrary) {
  double worst = 0;
  for (double base = 1e-12; base < 1e12; base *= 1.37)
    for (const double exponent : {-1.0, -0.2, -0.14, 0.08, 1.0 / 3, 1.0})
      worst = std::max(worst, std::abs(power(base, exponent) / std::pow(base, exponent) - 1));
  EXPECT_LT(worst, 1e-13);
  EXPECT_EQ(power(1, 0.3), 1);
}

}  // namespace
}  // namespace nadir::sim

#include <gtest/gtest.h>

#include "nadir/sim/adaptive.h"
#include "nadir/sim/dormand_prince.h"
#include "nadir/sim/rosenbrock.h"
#include "nadir/sim/stiffness.h"
#include "problems.h"
#ifdef NADIR_HAVE_ODEINT
#include "odeint_stiff.h"
#endif

namespace nadir::sim {
namespace {
using Eigen::Vector2d, Eigen::Vector3d;

TEST(Rosenbrock, ALinearSystemWithTimeConstantsAMillionApartTakesStepsOfTheSlowOne) {
  // x = e^(-t), e^(-1e4 t), e^(-1e6 t), mixed by an invertible matrix
  Eigen::Matrix3d mix;
  mix << 2, 1, 0, 1, 3, 1, 0, 1, 1;
  const Eigen::Matrix3d rates = mix * Vector3d(-1, -1e4, -1e6).asDiagonal() * mix.inverse();
  const auto f = [&](double, const Vector3d& x) -> Vector3d { return rates * x; };
  const auto tolerance = Tolerance<Vector3d>::same(Vector3d::Zero(), 1e-6, 0);
  Adaptive<Rosenbrock<Vector3d>> implicit(tolerance);
  Vector3d x = mix * Vector3d(1, 1, 1);
  ASSERT_TRUE(implicit.advance(f, 0, 1, x));
  const Vector3d exact = mix * Vector3d(std::exp(-1), 0, 0);
  EXPECT_LT((x - exact).norm(), 3e-5);
  EXPECT_LT(implicit.work().steps, 200);

  Adaptive<DormandPrince<Vector3d>> by_stability(tolerance, {.most_steps = 10000});
  Vector3d y = mix * Vector3d(1, 1, 1);
  EXPECT_FALSE(by_stability.advance(f, 0, 1, y)) << "an explicit method takes 300,000 steps";
  EXPECT_GT(by_stability.stiffness(), 2.5);
}

TEST(Rosenbrock, AWholeStepLeavesNothingOfAPartThatIsInfinitelyStiff) {
  // L-stable: the factor of a step tends to 0 as rate times step grows
  using One = Eigen::Matrix<double, 1, 1>;
  double before = 1;
  for (const double rate : {1e2, 1e4, 1e6, 1e8}) {
    Adaptive<Rosenbrock<One>> method(Tolerance<One>::same(One(0), 1e9, 0), {.first_s = 1});
    One x(1);
    ASSERT_TRUE(method.advance([=](double, const One& s) { return One(-rate * s[0]); }, 0, 1, x));
    EXPECT_EQ(method.work().steps, 1);
    EXPECT_LT(std::abs(x[0]), before / 10);
    before = std::abs(x[0]);
  }
  EXPECT_LT(before, 1e-6);
}

TEST(Rosenbrock, ProtheroAndRobinsonsProblemMeetsTheToleranceHoweverStiff) {
  for (const double rate : {-1e2, -1e4, -1e6}) {
    using One = ProtheroRobinson::Vector;
    for (const double asked : {1e-4, 1e-6}) {
      Adaptive<Rosenbrock<One>> method(Tolerance<One>::same(One(0), asked, 0));
      One x(1);
      ASSERT_TRUE(method.advance(ProtheroRobinson{rate}, 0, 10, x));
      EXPECT_NEAR(x[0], std::cos(10.0), 5 * asked);
      EXPECT_LT(method.work().steps, 1500) << "rate " << rate << ", tolerance " << asked;
    }
  }
}

TEST(Rosenbrock, VanDerPolsOscillatorMeetsPublishedValues) {
  // Source: Hairer and Wanner, Solving Ordinary Differential Equations II, 1996, section IV.10 and its test set: eps =
  // 1e-6 from (2, -0.66) to t = 1 and 2.
  Adaptive<Rosenbrock<Vector2d>> method({Vector2d(1e-9, 1e-9), 1e-9});
  Vector2d y(2, -0.66);
  ASSERT_TRUE(method.advance(VanDerPol{1e-6}, 0, 1, y));
  EXPECT_NEAR(y[0], -1.8636462548081, 1e-6);
  EXPECT_NEAR(y[1], 0.75354308654355, 1e-6);
  ASSERT_TRUE(method.advance(VanDerPol{1e-6}, 1, 2, y));
  EXPECT_NEAR(y[0], 1.70616773217048, 1e-6);
  EXPECT_NEAR(y[1], -0.8928097010247, 1e-6);
}

#ifdef NADIR_HAVE_ODEINT
TEST(Rosenbrock, VanDerPolsOscillatorWithMu10000AgreesWithOdeint) {
  // Past two jumps of the relaxation oscillation, which are 1e8 times shorter than its slow phases
  constexpr double eps = 1e-8;
  const auto reference = van_der_pol_by_odeint(eps, 2);
  for (const double asked : {1e-6, 1e-8}) {
    Adaptive<Rosenbrock<Vector2d>> method({Vector2d(asked, asked), asked});
    Vector2d y(2, -0.66);
    ASSERT_TRUE(method.advance(VanDerPol{eps}, 0, 2, y));
    EXPECT_NEAR(y[0], reference[0], 1000 * asked);
    EXPECT_NEAR(y[1], reference[1], 1000 * asked);
  }
}
#endif

TEST(Rosenbrock, AJacobianOfOnesOwnSavesTheEvaluationsOfDifferences) {
  struct Given : VanDerPol {
    void jacobian(double, const Vector2d& y, Eigen::Matrix2d& j) const {
      j << 0, 1, (-2 * y[0] * y[1] - 1) / eps, (1 - y[0] * y[0]) / eps;
    }
  };
  static_assert(GivesJacobian<Given, Vector2d> && !GivesJacobian<VanDerPol, Vector2d>);
  const Tolerance<Vector2d> tolerance{Vector2d(1e-6, 1e-6), 1e-6};
  Adaptive<Rosenbrock<Vector2d>> by_differences(tolerance), given(tolerance);
  Vector2d x(2, -0.66), y(2, -0.66);
  ASSERT_TRUE(by_differences.advance(VanDerPol{1e-6}, 0, 1, x));
  ASSERT_TRUE(given.advance(Given{{1e-6}}, 0, 1, y));
  EXPECT_NEAR(x[0], y[0], 1e-3);
  const auto work = given.work(), more = by_differences.work();
  // Six a step, five for each more attempt at it; the start's is the first step's, and one finds the first length
  EXPECT_EQ(work.evaluations, 6 * work.steps + 5 * work.rejected + 1);
  EXPECT_EQ(more.evaluations, 6 * more.steps + 5 * more.rejected + 1 + 2 * more.jacobians);
  EXPECT_EQ(work.jacobians, work.steps);
  EXPECT_EQ(work.factorisations, work.steps + work.rejected);
  EXPECT_EQ(work.solves, 6 * work.factorisations);
}

TEST(SpectralRadius, IsThatOfTheGreatestEigenvalueRealOrComplex) {
  Work work;
  EXPECT_NEAR(spectral_radius(Motor{}, 0, Vector2d(1, 2), work), 5000, 0.02 * 5000);
  EXPECT_LE(work.evaluations, 65);
  const auto oscillator = [](double, const Vector2d& x) { return Vector2d(x[1], -9e4 * x[0]); };
  EXPECT_NEAR(spectral_radius(oscillator, 0, Vector2d(0.1, 0), work), 300, 0.1 * 300);
  const auto constant = [](double, const Vector2d&) { return Vector2d(3, 4); };
  EXPECT_EQ(spectral_radius(constant, 0, Vector2d(1, 1), work), 0);
}

TEST(DormandPrinceStiffness, TellsAStiffMotionFromOneThatIsNot) {
  const auto greatest = [](const auto& f, auto x, double end, double asked) {
    using Vector = decltype(x);
    Adaptive<DormandPrince<Vector>> method(Tolerance<Vector>::same(x, asked, 0));
    EXPECT_TRUE(method.start(f, 0, x));
    double sum = 0;
    int steps = 0;
    for (; method.time_s() < end; ++steps) {
      EXPECT_TRUE(method.step(f, end));
      sum += method.stiffness();
    }
    return sum / steps;
  };
  EXPECT_GT(greatest(Motor{}, Vector2d(0, 0), 0.5, 1e-4), 2.8);
  EXPECT_LT(greatest(Kepler{}, Kepler::start(0.3), 6, 1e-8), 1.5);
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/sim/plan.h"

#include <gtest/gtest.h>

#include "problems.h"

namespace nadir::sim {
namespace {
using Eigen::Vector2d, Eigen::Vector4d;
using Method = Scheme::Method;

template <class F, class Vector>
Result<Plan> choose(const F& f, const Vector& x, double tolerance, const Trial& trial) {
  return choose_scheme([&](int) { return f; }, x, Tolerance<Vector>::same(x, tolerance, 0), trial);
}

bool tried(const Plan& plan, Method method) {
  return std::any_of(plan.tried.begin(), plan.tried.end(),
                     [&](const Candidate& one) { return one.scheme.method == method; });
}

TEST(ChooseScheme, WhatIsNotStiffIsFlownExplicitlyAndPaysForNoJacobian) {
  for (const double tolerance : {1e-3, 1e-6, 1e-9}) {
    const auto orbit = choose(Kepler{}, Kepler::start(0.5), tolerance, {.interval_s = 1, .intervals = 6});
    ASSERT_TRUE(orbit) << orbit.error().message;
    EXPECT_FALSE(orbit->stiff) << orbit->why;
    EXPECT_FALSE(tried(*orbit, Method::Rosenbrock));
    EXPECT_LE(*orbit->chosen.error, 1);
    for (const Candidate& one : orbit->tried) EXPECT_EQ(one.work.jacobians + one.work.factorisations, 0);
  }
}

TEST(ChooseScheme, AMotorWithAFastCurrentIsFlownImplicitlyWhereControlsAreSlow) {
  const auto derivative_of = [](int i) { return Motor{.voltage = i % 50 < 25 ? 10.0 : 6.0}; };
  const Vector2d start(10, 0);
  const auto plan = choose_scheme(derivative_of, start, Tolerance<Vector2d>::same(start, 1e-3, 0),
                                  {.interval_s = 0.01, .intervals = 100});
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_TRUE(plan->stiff);
  EXPECT_NEAR(plan->greatest_rate_per_s, 5000, 200);
  EXPECT_EQ(plan->scheme.method, Method::Rosenbrock) << plan->why;
  for (const char* word : {"implicit", "rosenbrock", "dormand-prince", "rk4", "evaluations an interval"})
    EXPECT_NE(plan->why.find(word), std::string::npos) << plan->why;
}

TEST(ChooseScheme, TheKindOfMethodInATableOfProblems) {
  struct Row {
    const char* name;
    Result<Plan> plan;
    bool implicit;
  };
  const auto lag = [](double rate) {
    return [=](double t, const ProtheroRobinson::Vector& x) { return ProtheroRobinson{-rate}(t, x); };
  };
  const ProtheroRobinson::Vector one(1);
  const Row rows[] = {
      {"orbit", choose(Kepler{}, Kepler::start(0.2), 1e-6, {.interval_s = 0.5, .intervals = 10}), false},
      {"slow lag", choose(lag(1), one, 1e-6, {.interval_s = 0.1, .intervals = 20}), false},
      {"lag of 20 ms at 400 Hz", choose(lag(50), one, 1e-6, {.interval_s = 0.0025, .intervals = 400}), false},
      {"lag of 0.1 ms at 10 Hz", choose(lag(1e4), one, 1e-4, {.interval_s = 0.1, .intervals = 20}), true},
      {"lag of 1 us at 10 Hz", choose(lag(1e6), one, 1e-4, {.interval_s = 0.1, .intervals = 2}), true},
      {"van der Pol, mu 10", choose(VanDerPol{1e-2}, Vector2d(2, 0), 1e-3, {.interval_s = 0.1, .intervals = 10}),
       false},
      {"van der Pol, mu 1000, before its jump",
       choose(VanDerPol{1e-6}, Vector2d(2, -0.66), 1e-4, {.interval_s = 0.05, .intervals = 10}), true},
  };
  for (const Row& row : rows) {
    ASSERT_TRUE(row.plan) << row.name << ": " << row.plan.error().message;
    EXPECT_EQ(row.plan->scheme.method == Method::Rosenbrock, row.implicit) << row.name << ": " << row.plan->why;
    EXPECT_LE(*row.plan->chosen.error, 1) << row.name;
  }
}

TEST(ChooseScheme, TakesTheCheapestOfWhatMeetsTheToleranceAndThePlanKeepsIt) {
  const auto plan = choose(Kepler{}, Kepler::start(0.2), 1e-5, {.interval_s = 0.5, .intervals = 12});
  ASSERT_TRUE(plan);
  for (const Candidate& one : plan->tried) EXPECT_TRUE(!one.error || *one.error > 1 || one.cost >= plan->chosen.cost);
  // What was planned is what flies
  const Vector4d start = Kepler::start(0.2);
  Integrator<Vector4d> integrator(plan->scheme, start, Tolerance<Vector4d>::same(start, 1e-5, 0));
  Vector4d x = start;
  for (int i = 0; i < 12; ++i) ASSERT_TRUE(integrator.advance(Kepler{}, 0.5 * i, 0.5 * (i + 1), x));
  EXPECT_EQ(integrator.work(), plan->chosen.work);
}

TEST(ChooseScheme, TheSameTrialGivesTheSamePlan) {
  const auto make = [] { return choose(VanDerPol{1e-4}, Vector2d(2, 0), 1e-4, {.interval_s = 0.1, .intervals = 5}); };
  const auto first = make(), second = make();
  ASSERT_TRUE(first);
  ASSERT_TRUE(second);
  EXPECT_EQ(first->why, second->why);
  EXPECT_EQ(first->scheme, second->scheme);
}

TEST(ChooseScheme, ADerivativeThatCostsLittleMakesLinearAlgebraDear) {
  const Work work{.evaluations = 100, .jacobians = 2, .factorisations = 3, .solves = 18};
  EXPECT_DOUBLE_EQ(cost_of(work, 6, false, {.flops_per_evaluation = 1e30}), 100);
  EXPECT_DOUBLE_EQ(cost_of(work, 6, true, {.flops_per_evaluation = 1e30, .given_jacobian = 4}), 108);
  EXPECT_DOUBLE_EQ(cost_of(work, 6, false, {.flops_per_evaluation = 72}), 100 + (3 * 144 + 18 * 72) / 72.0);
  EXPECT_EQ(cost_of(work, 6, false, {}), cost_of(work, 6, false, {.flops_per_evaluation = 120}));
}

TEST(ChooseScheme, AMotionThatNothingFliesIsSaid) {
  using One = Eigen::Matrix<double, 1, 1>;
  const auto explode = [](double, const One& x) { return One(x[0] * x[0]); };
  const auto plan = choose(explode, One(1), 1e-6, {.interval_s = 0.5, .intervals = 4});
  ASSERT_FALSE(plan);
  EXPECT_NE(plan.error().message.find("no scheme"), std::string::npos) << plan.error().message;
  EXPECT_NE(plan.error().message.find("t = 0.9999"), std::string::npos) << plan.error().message;
}

TEST(ChooseScheme, AToleranceBelowRoundingIsSaidWithOneThatIsMet) {
  // Errors that fall with steps down to three times the tolerance, as those do of a motion that rounding disturbs
  const Trial trial{.interval_s = 1, .intervals = 10, .most_steps = 64};
  const auto attempt = [&](double tolerance, const Scheme& scheme) {
    Candidate one{.scheme = scheme};
    one.cost = scheme.steps;
    one.error = std::max(3.0, 40.0 / scheme.steps + (scheme.method == Method::DormandPrince ? 10 : 0)) / tolerance;
    return one;
  };
  const auto plan = cheapest_scheme({}, trial, "", [&](const Scheme& s) { return attempt(1, s); });
  ASSERT_FALSE(plan);
  const std::string& said = plan.error().message;
  ASSERT_NE(said.find("; one of 3.3 times as much is met by rk4 with 16 steps"), std::string::npos) << said;
  EXPECT_TRUE(cheapest_scheme({}, trial, "", [&](const Scheme& s) { return attempt(3.3, s); }));
}

TEST(Integrator, EveryMethodFliesAnInterval) {
  const Vector4d start = Kepler::start(0.1);
  Vector4d exact = start;
  Adaptive<DormandPrince<Vector4d>> reference(Tolerance<Vector4d>::same(start, 1e-12, 0));
  ASSERT_TRUE(reference.advance(Kepler{}, 0, 1, exact));
  for (const auto& [scheme, bound] :
       {std::pair{Scheme{Method::Euler, 10000}, 1e-3}, std::pair{Scheme{Method::Heun, 1000}, 1e-5},
        std::pair{Scheme{Method::Midpoint, 1000}, 1e-5}, std::pair{Scheme{Method::Rk4, 100}, 1e-6},
        std::pair{Scheme{Method::DormandPrince}, 1e-5}, std::pair{Scheme{Method::Rosenbrock}, 1e-5}}) {
    Integrator<Vector4d> integrator(scheme, start, Tolerance<Vector4d>::same(start, 1e-6, 0));
    Vector4d x = start;
    ASSERT_TRUE(integrator.advance(Kepler{}, 0, 1, x));
    EXPECT_LT((x - exact).norm(), bound) << name_of(scheme.method);
    EXPECT_GT((x - exact).norm(), 0) << name_of(scheme.method);
  }
}

TEST(Integrator, FixedStepsThatDivergeSayWhen) {
  using One = Eigen::Matrix<double, 1, 1>;
  const auto stiff = [](double, const One& x) { return One(-1e150 * x[0]); };
  Integrator<One> integrator({Method::Rk4, 4}, One(1), Tolerance<One>::same(One(1), 1e-3, 0));
  One x(1);
  const auto done = integrator.advance(stiff, 2, 3, x);
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().message.find("t = 2.25 s"), std::string::npos) << done.error().message;
  EXPECT_EQ(x[0], 1);
}

}  // namespace
}  // namespace nadir::sim

// A program of its own: in it Eigen asks before each allocation.
#define EIGEN_RUNTIME_NO_MALLOC
#define eigen_assert(condition) static_cast<void>((condition) || ++nadir_failed_assertions)
inline int nadir_failed_assertions = 0;
#include <gtest/gtest.h>

#include "nadir/sim/integrator.h"

namespace nadir::sim {
namespace {

TEST(Integrator, AStepOfADynamicStateAllocatesNothingAfterTheFirst) {
  using Eigen::VectorXd;
  constexpr int size = 20;  // a row of masses on springs and dampers
  const auto row = [](double t, const VectorXd& x, VectorXd& change) {
    for (int i = 0; i < size / 2; ++i) {
      const double left = i > 0 ? x[2 * i - 2] : std::sin(t), right = i + 1 < size / 2 ? x[2 * i + 2] : 0;
      change[2 * i] = x[2 * i + 1];
      change[2 * i + 1] = 100 * (left - 2 * x[2 * i] + right) - x[2 * i + 1];
    }
  };
  const VectorXd start = VectorXd::Zero(size);
  for (const auto method : {Scheme::Method::Euler, Scheme::Method::Midpoint, Scheme::Method::Heun, Scheme::Method::Rk4,
                            Scheme::Method::DormandPrince, Scheme::Method::Rosenbrock}) {
    Integrator<VectorXd> integrator({method, 20}, start, Tolerance<VectorXd>::same(start, 1e-6, 0));
    VectorXd x = start;
    ASSERT_TRUE(integrator.advance(row, 0, 0.1, x));
    Eigen::internal::set_is_malloc_allowed(false);
    const auto done = integrator.advance(row, 0.1, 0.3, x);
    Eigen::internal::set_is_malloc_allowed(true);
    EXPECT_TRUE(done) << name_of(method);
    EXPECT_EQ(nadir_failed_assertions, 0) << name_of(method);
    EXPECT_GT(x.norm(), 0);
  }
}

TEST(Integrator, TheCheckSeesAnAllocation) {
  Eigen::internal::set_is_malloc_allowed(false);
  EXPECT_EQ(Eigen::VectorXd::Zero(100).eval().size(), 100);
  Eigen::internal::set_is_malloc_allowed(true);
  EXPECT_EQ(nadir_failed_assertions, 1);
  nadir_failed_assertions = 0;
}

}  // namespace
}  // namespace nadir::sim

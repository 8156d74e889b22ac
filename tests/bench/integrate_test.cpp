#include <gtest/gtest.h>

#include "breaking.h"
#include "integrate_suite.h"

namespace nadir::bench {
namespace {

TEST(Integrate, EachMethodBreaksWhereTheorySays) {
  const auto cases = breaking_cases();
  EXPECT_GE(cases.size(), 20);
  for (const Breaking& one : cases) {
    const auto outcome = one.run();
    EXPECT_TRUE(outcome.as_expected) << one.name << ": expected: " << one.expected << "; " << outcome.happened;
  }
}

TEST(Integrate, DormandPrinceTakesNoMoreThanOdeintsAndErrsNoMoreThanTenTolerances) {
  const auto cases = integrate_suite().cases({.quick = true});
  ASSERT_EQ(cases[4].name, "cruise, 10 s");
  const auto rows = run_case("integrate", cases[4], {.rounds = 1, .quick = true});
  ASSERT_TRUE(rows) << rows.error().message;
  const auto row_of = [&](const std::string& method) {
    return *std::find_if(rows->begin(), rows->end(),
                         [&](const Row& row) { return row.method == method && row.setting == "1e-06"; });
  };
  const Row ours = row_of("dormand-prince"), peer = row_of("odeint dopri5"), plan = row_of("plan");
  EXPECT_LE(*counter(ours, "evaluations"), *counter(peer, "evaluations"));
  for (const Row& row : {ours, peer, plan}) EXPECT_LE(*row.error, 1e-5) << row.method;
  EXPECT_TRUE(plan.counters.contains("why"));
}

}  // namespace
}  // namespace nadir::bench

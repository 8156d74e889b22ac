#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>

#include "stability_cases.h"
#include "support/temporary_folder.h"

namespace nadir::bench {

void PrintTo(const StabilityCase& one, std::ostream* out) { *out << one.name; }

namespace {

class Stability : public testing::TestWithParam<StabilityCase> {};

TEST_P(Stability, IsAsExpected) {
  const test::TemporaryFolder folder;
  const Outcome outcome = GetParam().run(folder.path());
  EXPECT_TRUE(outcome.as_expected) << "expected: " << GetParam().expected << "\nhappened: " << outcome.happened
                                   << "\nexact chain " << outcome.error_px.value_or(0) << " px, patches "
                                   << outcome.patch_error_px.value_or(0) << " px";
}

std::string name_of(const testing::TestParamInfo<StabilityCase>& info) {
  std::string name = info.param.name;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '.' || c == '-'; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Cases, Stability, testing::ValuesIn(stability_cases()), name_of);

}  // namespace
}  // namespace nadir::bench

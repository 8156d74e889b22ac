#include "flown_parts.h"

#include <gtest/gtest.h>

namespace nadir::sim {
namespace {

const ContactGear gear =
    ContactGear::create(
        {{.name = "left wheel", .kind = ContactPoint::Kind::Wheel, .stiffness_npm = 1000, .most_n = 100},
         {.name = "belly", .kind = ContactPoint::Kind::Part}})
        .value();

std::optional<GearCrash> crash(std::optional<double> breaks_s, std::optional<double> touches_s) {
  ContactReport report;
  if (breaks_s) report.broken = {0, *breaks_s};
  if (touches_s) report.part = {1, *touches_s};
  return crash_of(report, gear, 1'000'000'000, 1'010'000'000);
}

TEST(CrashOfAGear, IsWhatCameFirst) {
  EXPECT_FALSE(crash({}, {}));
  EXPECT_EQ(crash(1.004, {})->what, "the left wheel breaks");
  EXPECT_EQ(crash({}, 1.004)->what, "the belly meets the ground");
  EXPECT_EQ(crash(1.002, 1.004)->what, "the left wheel breaks");
  EXPECT_EQ(crash(1.004, 1.002)->what, "the belly meets the ground");
  EXPECT_EQ(crash(1.004, 1.002)->time_ns, 1'002'000'000);
}

TEST(CrashOfAGear, LiesWithinItsPeriodWhateverRounding) {
  EXPECT_EQ(crash(1.0 - 1e-9, {})->time_ns, 1'000'000'000);
  EXPECT_EQ(crash(1.01 + 1e-9, {})->time_ns, 1'010'000'000);
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/sim/scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace nadir::sim {
namespace {

using Stage = Scheduler::Stage;

Rate hz(const std::string& text) { return Rate::parse_hz(text).value(); }

/// floor(10^9 k / rate) for a rate of millionths of a hertz, in whole numbers.
std::int64_t exact_ns(std::int64_t k, std::int64_t micro_hz) {
  return static_cast<std::int64_t>(static_cast<__int128>(k) * 1'000'000'000'000'000 / micro_hz);
}

struct Event {
  char part;
  std::int64_t time_ns;
  friend bool operator==(const Event&, const Event&) = default;
};

/// Notes when it ran.
Scheduler::Task note(std::vector<Event>& events, char part) {
  return [&events, part](std::int64_t time_ns) -> Result<void> {
    events.push_back({part, time_ns});
    return {};
  };
}

std::string parts(const std::vector<Event>& events) {
  std::string text;
  for (const Event& e : events) text += e.part;
  return text;
}

TEST(Rate, SamplesLieWhereWholeNumberArithmeticPutsThem) {
  EXPECT_EQ(hz("30").time_ns(1), 33'333'333);
  EXPECT_EQ(hz("30").time_ns(2), 66'666'666) << "rounded down from the exact time, not twice a rounded period";
  EXPECT_EQ(hz("30").time_ns(3), 100'000'000);
  EXPECT_EQ(hz("29.97").time_ns(2997), 100'000'000'000);
  EXPECT_EQ(hz("0.1").time_ns(1), 10'000'000'000);
  EXPECT_EQ(hz("0.000001").time_ns(9), 9'000'000'000'000'000);
  EXPECT_EQ(hz("1000000").time_ns(12345), 12'345'000);
  for (const auto& [text, micro_hz] : {std::pair("30", 30'000'000),
                                       {"29.97", 29'970'000},
                                       {"0.1", 100'000},
                                       {"400", 400'000'000},
                                       {"59.940059", 59'940'059}})
    for (const std::int64_t k : {0, 1, 2, 7, 1000, 12'345'678})
      EXPECT_EQ(hz(text).time_ns(k), exact_ns(k, micro_hz)) << text << " Hz, sample " << k;
}

TEST(Rate, DoesNotDriftInABillionSamples) {
  EXPECT_EQ(hz("30").time_ns(1'000'000'000), 33'333'333'333'333'333)
      << "a period kept in nanoseconds would be 0.3 s early by then";
  EXPECT_EQ(hz("29.97").time_ns(2'997'000'000), 100'000'000'000'000'000);
  for (std::int64_t k = 1'000'000'000; k < 1'000'000'030; ++k) {
    const std::int64_t period_ns = hz("30").time_ns(k + 1) - hz("30").time_ns(k);
    EXPECT_TRUE(period_ns == 33'333'333 || period_ns == 33'333'334) << k;
  }
}

TEST(Rate, IsReadFromDecimalTextOnly) {
  EXPECT_EQ(hz(" 10 ").hz(), 10);
  EXPECT_EQ(hz("29.97").hz(), 29.97);
  EXPECT_EQ(hz(".5").hz(), 0.5);
  for (const char* bad : {"", "0", "-1", "1e3", "0.0000001", "0.0000009", "1.0000001", "1000000.000001", "nan", "inf",
                          "10 Hz", "1/30", "99999999999999999999"}) {
    const auto rate = Rate::parse_hz(bad);
    ASSERT_FALSE(rate) << bad;
    EXPECT_NE(rate.error().message.find("expected a rate from 0.000001"), std::string::npos) << rate.error().message;
  }
}

TEST(Scheduler, RunsEverySampleAtItsOwnTimeInTheOrderOfTime) {
  Scheduler scheduler;
  std::vector<Event> events;
  scheduler.add(Stage::Observe, hz("30"), note(events, 'c'));
  scheduler.add(Stage::Observe, hz("7"), note(events, 'd'));
  ASSERT_TRUE(scheduler.run(1'000'000'000));
  std::vector<Event> expected;
  for (std::int64_t k = 0; k <= 30; ++k) expected.push_back({'c', exact_ns(k, 30'000'000)});
  for (std::int64_t k = 0; k <= 7; ++k) expected.push_back({'d', exact_ns(k, 7'000'000)});
  std::stable_sort(expected.begin(), expected.end(),
                   [](const Event& a, const Event& b) { return a.time_ns < b.time_ns; });
  EXPECT_EQ(events, expected);
}

TEST(Scheduler, AtOneInstantDecisionsComeBeforeObservationsBeforeMotion) {
  Scheduler scheduler;
  std::vector<Event> events;
  scheduler.add(Stage::Move, hz("2"), note(events, 'm'));
  scheduler.add(Stage::Observe, hz("2"), note(events, 'o'));
  scheduler.add(Stage::Decide, hz("1"), note(events, 'd'));
  scheduler.add(Stage::Observe, hz("1"), note(events, 'p'));
  scheduler.add(Stage::Decide, hz("2"), note(events, 'e'));
  ASSERT_TRUE(scheduler.run(1'000'000'000));
  EXPECT_EQ(parts(events),
            "deopm"
            "eom"
            "deop")
      << "within a stage in the order of addition; no motion at the end";
}

TEST(Scheduler, MotionStopsAtTheEndAndObservationIncludesIt) {
  for (const std::int64_t end_ns : {999'999'999, 1'000'000'000, 1'000'000'001}) {
    Scheduler scheduler;
    std::vector<Event> moves, looks;
    scheduler.add(Stage::Move, hz("1"), note(moves, 'm'));
    scheduler.add(Stage::Observe, hz("1"), note(looks, 'o'));
    ASSERT_TRUE(scheduler.run(end_ns));
    EXPECT_EQ(moves.size(), end_ns > 1'000'000'000 ? 2u : 1u) << end_ns;
    EXPECT_EQ(looks.size(), end_ns >= 1'000'000'000 ? 2u : 1u) << end_ns;
  }
}

TEST(Scheduler, NothingRunsAfterTheFirstFailure) {
  Scheduler scheduler;
  std::vector<Event> events;
  scheduler.add(Stage::Decide, hz("10"), note(events, 'a'));
  scheduler.add(Stage::Observe, hz("5"), [&](std::int64_t time_ns) -> Result<void> {
    events.push_back({'f', time_ns});
    if (time_ns >= 400'000'000) return fail(Error::Kind::Io, "the disk is full");
    return {};
  });
  scheduler.add(Stage::Observe, hz("5"), note(events, 'b'));
  const auto done = scheduler.run(10'000'000'000);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "the disk is full");
  EXPECT_EQ(parts(events),
            "afb"
            "a"
            "afb"
            "a"
            "af");
}

TEST(Scheduler, NothingToDoEndsAtOnce) {
  EXPECT_TRUE(Scheduler().run(std::int64_t{1} << 62));
  Scheduler slow;
  std::vector<Event> events;
  slow.add(Stage::Observe, hz("0.000001"), note(events, 's'));
  EXPECT_TRUE(slow.run(1'000'000'000));
  EXPECT_EQ(parts(events), "s");
}

TEST(Scheduler, PacingDelaysAndChangesNoSequence) {
  // Parts that take unlike times to run, the slowest longer than its period lasts at this pace: it falls behind
  const auto run = [](double pace) {
    Scheduler scheduler;
    std::vector<Event> events;
    std::minstd_rand random(1);
    const char* names = "abc";
    int i = 0;
    for (const auto& [stage, rate] : {std::pair(Stage::Move, "100"), {Stage::Observe, "33"}, {Stage::Decide, "50"}})
      scheduler.add(stage, hz(rate), [&events, &random, pace, name = names[i++]](std::int64_t time_ns) -> Result<void> {
        if (pace > 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 4000));
        events.push_back({name, time_ns});
        return {};
      });
    EXPECT_TRUE(scheduler.run(200'000'000, pace));
    return events;
  };
  const auto start = std::chrono::steady_clock::now();
  const auto paced = run(2);
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(95))
      << "the last motion is at 190 ms, half of that at twice the speed";
  EXPECT_EQ(paced, run(0));
  EXPECT_EQ(paced.size(), 20u + 7u + 11u);
}

TEST(Scheduler, AnyPaceIsKeptInRange) {
  Scheduler scheduler;
  std::vector<Event> events;
  scheduler.add(Stage::Observe, hz("1"), note(events, 'o'));
  EXPECT_TRUE(scheduler.run(3'000'000'000, 1e300));
  EXPECT_EQ(events.size(), 4u) << "as fast as possible";
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/bench/runner.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "nadir/bench/measure.h"
#include "nadir/bench/report.h"
#include "nadir/bench/statistics.h"

namespace nadir::bench {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t mib = 1 << 20;

Result<void> touch(std::size_t bytes) {
  std::vector<char> memory(bytes);
  for (std::size_t i = 0; i < bytes; i += 512) static_cast<volatile char&>(memory[i]) = 1;
  return {};
}

TEST(Statistics, QuantilesLieBetweenRanks) {
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 3, 2}), 2.5);
  EXPECT_EQ(quantile({0, 10, 20, 30, 40}, 0.25), 10);
  EXPECT_EQ(quantile({0, 10}, 0.25), 2.5);
  EXPECT_EQ(quantile({7}, 1), 7);
}

TEST(Statistics, APairedRatioIsNotMovedByWhatSlowsBoth) {
  // Twice as long, but for two rounds in which only a was disturbed, while the machine gets slower.
  const std::vector<double> b = {1, 2, 3, 10, 10}, a = {10, 20, 6, 20, 20};
  EXPECT_GT(median(a) / median(b), 6) << "what is not meant";
  EXPECT_EQ(paired_ratio(a, b), 2);
}

TEST(Statistics, TheParetoFrontHoldsWhatNoneBeats) {
  const std::vector<double> time = {1, 2, 3, 2, 4}, error = {9, 4, 5, 6, 4};
  EXPECT_EQ(pareto_front(time, error), (std::vector<std::size_t>{0, 1}));
}

TEST(Runner, TakesTheTimesThatAMethodTells) {
  Comparison comparison{.warm_up = false};
  comparison.methods = {{.name = "a",
                         .told = []() -> Result<Usage> {
                           return Usage{3, 5, 7};
                         }},
                        {.name = "b", .told = []() -> Result<Usage> {
                           return Usage{2, 2, 9};
                         }}};
  comparison.aims_of = [](const std::vector<Row>& rows) -> std::vector<Aim> {
    EXPECT_EQ(rows[0].wall_ms, 3);
    return {{.method = "a", .baseline = "b", .most = 2, .what = "sharp", .missed = "blurred"}};
  };
  comparison.picture = []() -> Result<std::string> { return "p.png"; };
  const auto rows = run_comparison("s", "c", comparison, {.rounds = 3});
  ASSERT_TRUE(rows);
  EXPECT_EQ((*rows)[0].cpu_ms, 5);
  EXPECT_EQ((*rows)[0].peak_bytes, 7u);
  EXPECT_EQ((*rows)[0].counters.at("ratio:b (sharp)"), "1.5");
  EXPECT_EQ((*rows)[0].counters.at("aim:b (sharp)"), "2");
  EXPECT_EQ((*rows)[0].counters.at("picture"), "p.png");
  EXPECT_NE(to_table(*rows).find("1.50x b (sharp) (aim 2.00x) miss: blurred"), std::string::npos) << to_table(*rows);
}

TEST(Runner, WhereOthersGoOnAMethodThatFailsHasARowThatSaysWhyAndNoTimes) {
  int runs = 0;
  Comparison comparison{.warm_up = false, .go_on = true};
  comparison.methods = {{.name = "good", .run = []() -> Result<void> { return {}; }},
                        {.name = "bad",
                         .run = [&]() -> Result<void> {
                           ++runs;
                           return fail(Error::Kind::Io, "a=b; no disk");
                         }},
                        {.name = "absent", .left_out = "not installed"}};
  comparison.aims = {{"good", "bad"}, {"good", "absent"}};
  const auto rows = run_comparison("s", "c", comparison, {.rounds = 3});
  ASSERT_TRUE(rows);
  EXPECT_EQ((*rows)[0].counters.at("rounds"), "3");
  EXPECT_FALSE((*rows)[0].counters.contains("ratio:bad"));
  EXPECT_EQ(runs, 1) << "it is not tried again";
  EXPECT_FALSE((*rows)[1].wall_ms);
  EXPECT_EQ((*rows)[1].counters.at("fault"), "a b, no disk");
  EXPECT_EQ((*rows)[2].counters.at("left_out"), "not installed");
  EXPECT_EQ(from_csv("rows", to_csv(*rows)).value(), *rows);
  EXPECT_NE(to_table(*rows).find("failed: a b, no disk"), std::string::npos);

  comparison.go_on = false;
  EXPECT_FALSE(run_comparison("s", "c", comparison, {.rounds = 1}));
}

TEST(Runner, ProgramsThatFollowAddTheirTimeAndMemoriesAreCompared) {
  // sleep takes no CPU, and the shell with its text of 8 MiB more memory than it
  Comparison comparison{.warm_up = false, .rounds = 1};
  comparison.methods = {{.name = "two", .command = {"sleep", "0.05"}, .then = {{"sleep", "0.05"}}},
                        {.name = "fat", .command = {"sh", "-c", "x=$(head -c 8388608 /dev/zero | tr '\\0' x)"}}};
  comparison.aims = {{.method = "fat", .baseline = "two", .most = 1, .cost = Cost::peak}};
  const auto rows = run_comparison("s", "c", comparison, {.rounds = 2});
  ASSERT_TRUE(rows) << rows.error().message;
  EXPECT_GE((*rows)[0].wall_ms, 100);
  EXPECT_EQ((*rows)[0].counters.at("rounds"), "1") << "the comparison's own number";
  EXPECT_GT(counter((*rows)[1], "peak_ratio:two"), 2);
  EXPECT_EQ((*rows)[1].counters.at("peak_aim:two"), "1");
}

TEST(Runner, MethodsTakeTurnsAndEachRoundBeginsOneLater) {
  std::string order;
  Comparison comparison;
  for (const char* name : {"A", "B", "C"})
    comparison.methods.push_back({.name = name,
                                  .run = [&order, name]() -> Result<void> {
                                    order += name;
                                    return {};
                                  },
                                  // Called once a round because of this
                                  .before = []() -> Result<void> { return {}; }});
  ASSERT_TRUE(run_comparison("s", "c", comparison, {.rounds = 4}));
  EXPECT_EQ(order,
            "ABC"
            "ABC"
            "BCA"
            "CAB"
            "ABC")
      << "one warm-up, four rounds";
}

TEST(Runner, RowsHoldMediansErrorsRatesAndRatios) {
  const auto sleep = [](auto time) {
    return [time]() -> Result<void> {
      std::this_thread::sleep_for(time);
      return {};
    };
  };
  Comparison comparison{.methods = {{.name = "slow",
                                     .setting = "threads=1",
                                     .run = sleep(8ms),
                                     .error = []() -> Result<double> { return 0.5; },
                                     .counters =
                                         [] {
                                           return std::map<std::string, std::string>{{"tiles", "9"}};
                                         }},
                                    {.name = "fast", .setting = "threads=2", .run = sleep(2ms)}},
                        .error_unit = "DN",
                        .work = 4,
                        .work_unit = "MB",
                        .aims = {{.method = "slow, threads=1", .baseline = "fast, threads=2", .most = 0.85}},
                        .point = Point{"sleeping", 16, "side, texels"}};
  const auto rows = run_comparison("s", "c", comparison, {.rounds = 5}).value();
  ASSERT_EQ(rows.size(), 2u);
  const Row& slow = rows[0];
  EXPECT_EQ(slow.setting, "threads=1");
  EXPECT_EQ(slow.error, 0.5);
  EXPECT_EQ(slow.error_unit, "DN");
  EXPECT_FALSE(rows[1].error);
  EXPECT_GE(*slow.wall_ms, 8) << "a sleep lasts at least as long as it says";
  EXPECT_LT(*slow.cpu_ms, *slow.wall_ms / 2) << "sleeping takes no CPU";
  EXPECT_LE(counter(slow, "wall_min_ms").value(), *slow.wall_ms);
  EXPECT_EQ(counter(slow, "rounds"), 5);
  EXPECT_EQ(counter(slow, "tiles"), 9);
  EXPECT_NEAR(counter(slow, "rate").value() * *slow.wall_ms, 4000, 0.1) << "six digits are kept";
  EXPECT_GT(counter(slow, "ratio:fast, threads=2").value(), 1);
  EXPECT_FALSE(slow.commit.empty());
  EXPECT_EQ(from_csv("f", to_csv(rows)).value(), rows);
  EXPECT_NE(to_table(rows).find("fast, threads=2 (aim 0.85x) miss"), std::string::npos) << to_table(rows);
}

TEST(Runner, ShortMethodsAreCalledOftenEnoughForTheClock) {
  const auto rows =
      run_comparison("s", "c", {.methods = {{.name = "nothing", .run = []() -> Result<void> { return {}; }}}},
                     {.rounds = 3})
          .value();
  EXPECT_GT(counter(rows[0], "calls").value(), 10);
  EXPECT_LT(*rows[0].wall_ms, 2) << "of one call, not of all";
}

TEST(Runner, AFailureNamesCaseAndMethod) {
  const Method broken{.name = "m", .run = []() -> Result<void> { return fail(Error::Kind::Damaged, "tile 3: cut"); }};
  const auto rows = run_comparison("s", "c", {.methods = {broken}}, {.rounds = 3});
  ASSERT_FALSE(rows);
  EXPECT_EQ(rows.error().message, "c: m: tile 3: cut");
  EXPECT_EQ(rows.error().kind, Error::Kind::Damaged);
}

TEST(Runner, ACaseRunsInAProcessOfItsOwnWhoseEndIsTold) {
  int prepared = 0;
  const Case good{"good", [&]() -> Result<Comparison> {
                    ++prepared;
                    return Comparison{.methods = {{.name = "m", .run = []() -> Result<void> { return {}; }}}};
                  }};
  const auto rows = run_case("s", good, {.rounds = 3});
  ASSERT_TRUE(rows) << rows.error().message;
  EXPECT_EQ(rows->front().method, "m");
  EXPECT_EQ(prepared, 0);
  const Case dying{"dying", []() -> Result<Comparison> { ::_exit(3); }};
  EXPECT_NE(run_case("s", dying, {}).error().message.find("exited with 3"), std::string::npos);
  const Case unready{"unready", []() -> Result<Comparison> { return fail(Error::Kind::Exists, "no room"); }};
  EXPECT_EQ(run_case("s", unready, {}).error().message, "unready: no room");
  EXPECT_EQ(run_case("s", unready, {}).error().kind, Error::Kind::Exists);
}

TEST(Measure, PeakMemoryIsOfTheMethodAlone) {
  ASSERT_TRUE(touch(256 * mib)) << "what this process took before must not show";
  // The kernel's counters lag by 64 pages of 4 KiB a thread, up or down, in each of four readings: 1 MiB.
  const auto little = peak_in_child([] { return touch(0); }), much = peak_in_child([] { return touch(65 * mib); });
  ASSERT_TRUE(little && much);
  EXPECT_GE(*much, *little + 64 * mib);
  EXPECT_LT(*much, 80 * mib) << "and a quarter for the library";
}

TEST(Measure, TheRowOfAMethodHoldsItsPeak) {
  const auto rows = run_comparison(
      "s", "c", {.methods = {{.name = "m", .run = [] { return touch(65 * mib); }, .peak = true}}}, {.rounds = 3});
  EXPECT_GE(rows.value()[0].peak_bytes.value(), 64 * mib);
}

TEST(Measure, ACommandTellsItsTimeAndItsOwnMemory) {
  std::vector<char> large(256 * mib, 1);  // of this process: Linux counts it to what we start, and we must not
  const auto nap = measure_command({"sleep", "0.05"});
  ASSERT_TRUE(nap) << nap.error().message;
  EXPECT_GE(nap->wall_ms, 50);
  EXPECT_LT(nap->cpu_ms, nap->wall_ms / 2);
  ASSERT_TRUE(nap->peak_bytes);
  EXPECT_LT(*nap->peak_bytes, 64 * mib);
  EXPECT_GT(*nap->peak_bytes, 0u);
  const auto busy = measure_command({"/usr/bin/python3", "-c", "b = b'1' * (64 << 20); sum(range(1000000))"});
  ASSERT_TRUE(busy) << busy.error().message;
  EXPECT_GE(busy->peak_bytes.value(), 64 * mib);
  EXPECT_GT(busy->cpu_ms, 1) << "a million additions of an interpreter";
  EXPECT_EQ(large[1], 1);
}

TEST(Measure, ACommandThatFailsIsAnErrorWithItsWords) {
  EXPECT_EQ(measure_command({"no-such-program"}).error().kind, Error::Kind::NotFound);
  const auto failed = measure_command({"sh", "-c", "echo no map >&2; exit 7"});
  ASSERT_FALSE(failed);
  EXPECT_NE(failed.error().message.find("exited with 7: no map"), std::string::npos) << failed.error().message;
  EXPECT_NE(measure_command({"sh", "-c", "kill -9 $$"}).error().message.find("signal 9"), std::string::npos);
}

}  // namespace
}  // namespace nadir::bench

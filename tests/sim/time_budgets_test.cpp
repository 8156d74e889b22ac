// Time budgets of sensors: resolved once, before the first frame, from the whole flight.
#include "flown_run.h"
#include "nadir/render/quality_ladder.h"
#include "nadir/sim/rehearsal.h"

namespace nadir::sim {
namespace {

constexpr double ample_ms = 60e3, too_little_ms = 1e-3;  // frames of 120 x 90 take a few milliseconds at most

class TimeBudgets : public FlownRun {
 protected:
  Recorder execute(sim::Run& run) {
    Recorder recorder;
    render::Renderer renderer({.threads = 1});
    const std::array<Sink*, 1> sinks = {&recorder};
    const auto done = run.execute(renderer, sinks, true, 0);
    EXPECT_TRUE(done) << (done ? "" : done.error().message);
    if (done) late = done->late;
    return recorder;
  }
  std::int64_t late = 0;
};

TEST_F(TimeBudgets, ARunThatResolvedThemFliesAsItsFileThenSays) {
  auto run =
      prepare(plane("p", sensor("fast", "4", fmt::format(", time_budget_ms: {}", too_little_ms)) +
                             sensor("fine", "2", fmt::format(", time_budget_ms: {}, exposure_s: 0.01", ample_ms)) +
                             sensor("free", "2")),
              "2");
  ASSERT_TRUE(run) << run.error().message;
  const Recorder first = execute(*run);
  EXPECT_EQ(late, 9) << "of one sensor all, of the others none";
  const auto setup = [&](const char* name) { return run->sensor("p", name).setup; };
  EXPECT_EQ(setup("fast").quality, render::Quality::draft);
  EXPECT_EQ(setup("fine").oversampling, 8.1);
  EXPECT_FALSE(setup("fast").time_budget_ms || setup("fine").time_budget_ms);
  EXPECT_EQ(setup("fine").fitted_to_ms, ample_ms);
  EXPECT_FALSE(setup("free").quality || run->sensor("p", "free").fitted);
  EXPECT_EQ(run->sensor("p", "fine").fitted->probes, 5u);

  const auto file = read_run_file(folder.write("resolved.yaml", to_yaml(run->file())));
  ASSERT_TRUE(file) << file.error().message;
  auto again = sim::Run::prepare(*file);
  ASSERT_TRUE(again);
  const Recorder second = execute(*again);
  for (const char* name : {"p/fast", "p/fine", "p/free"}) {
    const auto &a = first.exposures.at(name), &b = second.exposures.at(name);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].samples, b[i].samples) << name << ' ' << i;
      EXPECT_FALSE(a[i].truth.adaptive);
    }
  }
  EXPECT_EQ(to_yaml(again->file()), to_yaml(*file));
}

TEST_F(TimeBudgets, ResolvingTakesTheFramesTriedAndIsDoneOnce) {
  auto run = prepare(plane("p", sensor("cam", "4", fmt::format(", time_budget_ms: {}", ample_ms))), "1");
  ASSERT_TRUE(run);
  render::Renderer renderer;
  int tried = 0;
  const auto count = [&](render::Frame frame) -> Result<void> {
    EXPECT_EQ(frame.layer("cam").width, 120);
    ++tried;
    return {};
  };
  ASSERT_TRUE(run->fit_time_budgets(renderer, count));
  const int finer = static_cast<int>(render::quality_ladder().size()) - 1, expected = 5 * (2 + 3) + finer * 5 * (1 + 3);
  EXPECT_EQ(tried, expected) << "of five poses and all ways, each warm";
  ASSERT_TRUE(run->fit_time_budgets(renderer, count));
  EXPECT_EQ(tried, expected);

  auto other = prepare(plane("p", sensor("cam", "4", fmt::format(", time_budget_ms: {}", ample_ms))), "1");
  const auto failed =
      other->fit_time_budgets(renderer, [](render::Frame) -> Result<void> { return fail(Error::Kind::Io, "full"); });
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message, "sensor cam: full");
}

TEST_F(TimeBudgets, AnAdaptiveSensorKeepsItsBudgetAndItsFramesSaySo) {
  auto run =
      prepare(plane("p", sensor("cam", "10", fmt::format(", time_budget_ms: {}, adaptive: true", too_little_ms))), "2");
  ASSERT_TRUE(run);
  const std::string before = to_yaml(run->file());
  const Recorder flown = execute(*run);
  EXPECT_EQ(to_yaml(run->file()), before) << "a replay adapts again";
  EXPECT_EQ(flown.exposures.at("p/cam").size(), 21u);
  for (const auto& exposure : flown.exposures.at("p/cam")) {
    EXPECT_TRUE(exposure.truth.adaptive);
    EXPECT_EQ(exposure.truth.quality, render::Quality::draft) << "the budget is too small for anything else";
  }
}

TEST_F(TimeBudgets, ARehearsalKeepsExposuresThatAreSpreadOverTheRun) {
  for (const auto& [rate_hz, count] : {std::pair("4", 9u), {"50", 101u}, {"1000", 2001u}}) {
    auto run = prepare(plane("p", sensor("cam", rate_hz) + sensor("other", "1")), "2");
    ASSERT_TRUE(run);
    Rehearsal rehearsal(*run, 4);
    render::Renderer renderer;
    const std::array<Sink*, 1> sinks = {&rehearsal};
    ASSERT_TRUE(run->execute(renderer, sinks, false, 0));
    EXPECT_EQ(rehearsal.count(0), count);
    EXPECT_EQ(rehearsal.count(1), 3u);
    EXPECT_EQ(rehearsal.kept(1).size(), 3u);
    const auto& kept = rehearsal.kept(0);
    EXPECT_GE(kept.size(), std::min<std::size_t>(count, 32)) << "half of the most";
    EXPECT_LE(kept.size(), 64u);
    const std::int64_t step_ns = kept[1].state.time_ns;
    for (std::size_t i = 0; i < kept.size(); ++i)
      EXPECT_EQ(kept[i].state.time_ns, static_cast<std::int64_t>(i) * step_ns);
    EXPECT_GT(kept.back().state.time_ns, 2'000'000'000 - 2 * step_ns);
    EXPECT_GT(kept.back().truth.height_agl_m, 0);
  }
}

}  // namespace
}  // namespace nadir::sim

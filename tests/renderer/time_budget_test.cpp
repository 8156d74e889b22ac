// Ways of sampling chosen for a time, with clocks that tests make up, and with the machine's.
#include "nadir/render/time_budget.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "support/scene.h"

namespace nadir::render {
namespace {

std::size_t rung_of(const RenderOptions& options) {
  const auto ladder = quality_ladder();
  for (std::size_t k = 0; k < ladder.size(); ++k)
    if (ladder[k].quality == options.quality && ladder[k].oversampling == options.oversampling) return k;
  ADD_FAILURE() << "not on the ladder";
  return 0;
}

/// A machine whose time for probe p at rung k is `ms[p] * (k + 1)`, twice as long the first time; probes of 0 see no
/// map.
struct MadeUpMachine {
  std::vector<double> ms;
  std::set<std::pair<std::size_t, std::size_t>> warm = {};
  int renderings = 0;
  std::size_t finest = 0;
  RenderProbe probe() {
    return [this](std::size_t p, const RenderOptions& options) -> Result<ProbedFrame> {
      const std::size_t rung = rung_of(options);
      ++renderings;
      finest = std::max(finest, rung);
      const double time = ms.at(p) * static_cast<double>(rung + 1);
      return ProbedFrame{warm.insert({p, rung}).second ? 2 * time : time, time > 0};
    };
  }
};

TEST(TimeBudget, TheFinestWayWhoseSlowestProbeFitsIsTakenWarm) {
  for (const auto& [budget_ms, rung] :
       {std::pair(2.0, 0u), {3.9, 0u}, {4.0, 1u}, {6.5, 2u}, {13.0, 5u}, {14.0, 6u}, {1e6, 7u}}) {
    MadeUpMachine machine{{1, 2, 0.5}};
    const auto fitted = fit_time_budget(3, machine.probe(), {.fill_value = 7}, budget_ms).value();
    EXPECT_EQ(fitted.rung, rung) << budget_ms;
    EXPECT_TRUE(fitted.fits());
    EXPECT_EQ(fitted.expected_ms(), 2.0 * (rung + 1));
    EXPECT_EQ(rung_of(fitted.options), rung);
    EXPECT_EQ(fitted.options.fill_value, 7) << "what else was asked for stands";
    EXPECT_FALSE(fitted.options.adaptive);
    EXPECT_EQ(fitted.measured_ms.size(), std::min<std::size_t>(rung + 2, quality_ladder().size()))
        << "the first one over the budget is the last";
    EXPECT_EQ(machine.finest, std::min<std::size_t>(rung + 1, quality_ladder().size() - 1));
  }
}

TEST(TimeBudget, OneSlowMomentDecidesNothing) {
  MadeUpMachine machine{{1}};
  const RenderProbe steady = machine.probe();
  const RenderProbe disturbed = [&](std::size_t p, const RenderOptions& options) {
    auto frame = steady(p, options);
    if (machine.renderings % 4 == 0) frame->ms *= 50;  // one in each three that are timed, and one that is not
    return frame;
  };
  EXPECT_EQ(fit_time_budget(1, disturbed, {}, 7.5)->rung, 6u);
}

TEST(TimeBudget, WhereTheCheapestMissesItIsTakenAndSaid) {
  MadeUpMachine machine{{1, 4, 2}};
  const auto fitted = fit_time_budget(3, machine.probe(), {}, 0.001).value();
  EXPECT_FALSE(fitted.fits());
  EXPECT_EQ(fitted.rung, 0u);
  EXPECT_EQ(fitted.measured_ms, std::vector{4.0});
  const std::string said = to_string(fitted);
  for (const char* word : {"0.001 ms", "not kept", "draft", "4.00 ms", "3 frames"})
    EXPECT_NE(said.find(word), std::string::npos) << said;
}

TEST(TimeBudget, ProbesThatSeeNothingAreLeftOut) {
  MadeUpMachine machine{{0, 1, 0}};
  const auto fitted = fit_time_budget(3, machine.probe(), {}, 3).value();
  EXPECT_EQ(fitted.rung, 2u);
  EXPECT_EQ(fitted.probes, 1u);

  for (const std::vector<double>& ms : {std::vector<double>{0, 0}, std::vector<double>{}}) {
    MadeUpMachine blind{ms};
    const auto unknown = fit_time_budget(ms.size(), blind.probe(), {}, 1000).value();
    EXPECT_EQ(unknown.rung, 0u) << "frames to come may see something: the cheapest is safe";
    EXPECT_FALSE(unknown.fits() || unknown.expected_ms());
    EXPECT_NE(to_string(unknown).find("no frame tried sees a map"), std::string::npos);
  }
}

TEST(TimeBudget, WhatIsNoBudgetIsRefusedBeforeAnythingIsRendered) {
  MadeUpMachine machine{{1}};
  for (const double ms : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_NE(
        fit_time_budget(1, machine.probe(), {}, ms).error().message.find("time budget: expected a positive number"),
        std::string::npos);
  for (const RenderOptions& options :
       {RenderOptions{.max_error = 2}, RenderOptions{.filter = Filter::Mip}, RenderOptions{.oversampling = 2}})
    EXPECT_NE(fit_time_budget(1, machine.probe(), options, 10).error().message.find("ask for no filter"),
              std::string::npos);
  EXPECT_EQ(machine.renderings, 0);
}

TEST(TimeBudget, WhatFailsIsPassedOn) {
  int left = 0;
  const RenderProbe fails = [&](std::size_t, const RenderOptions&) -> Result<ProbedFrame> {
    if (left-- == 0) return fail(Error::Kind::Io, "gone");
    return ProbedFrame{1, true};
  };
  for (const int good : {0, 1, 2, 4, 5, 6}) {  // first and second look, timed, warmed at the next rung, timed there
    left = good;
    EXPECT_EQ(fit_time_budget(1, fails, {}, 10).error().message, "gone") << good;
  }
}

TEST(TimeBudget, ProbesAreSpreadOverAFlightFromItsFirstFrameToItsLast) {
  using Indices = std::vector<std::size_t>;
  EXPECT_EQ(choose_probes(0), Indices{});
  EXPECT_EQ(choose_probes(1), (Indices{0}));
  EXPECT_EQ(choose_probes(3), (Indices{0, 1, 2}));
  EXPECT_EQ(choose_probes(5), (Indices{0, 1, 2, 3, 4}));
  EXPECT_EQ(choose_probes(1001), (Indices{0, 250, 500, 750, 1000}));
}

class TimeBudgetOfFrames : public testing::Test {
 protected:
  const tile::Map map = tile::Map::open(NADIR_SOURCE_DIR "/sim/demo/maps/kampala.tif").value();
  const Scene scene = Scene::plane(map.center(), {}).with_layer("l", map, {.bands = {1, 2, 3}});
  const Camera camera = test::square_camera(160, 160);
};

TEST_F(TimeBudgetOfFrames, FramesDependOnWhatWasResolvedAlone) {
  const std::vector<CameraPose> poses = {test::over_centre(map, 40), test::over_centre(map, 60)};
  Renderer renderer({.threads = 1}), fresh;
  const auto generous = fit_time_budget(renderer, scene, camera, poses, {}, 60e3).value();
  EXPECT_EQ(generous.rung, quality_ladder().size() - 1);
  EXPECT_EQ(generous.probes, 2u);
  EXPECT_LT(*generous.expected_ms(), 60e3);
  const Frame frame = renderer.render(scene, camera, poses[0], generous.options).value();
  EXPECT_EQ(frame.layer().samples,
            fresh.render(scene, camera, poses[0], {.quality = Quality::balanced, .oversampling = 8.1})
                .value()
                .layer()
                .samples);

  const auto hopeless = fit_time_budget(renderer, scene, camera, std::span(poses).first(1), {}, 1e-3).value();
  EXPECT_FALSE(hopeless.fits());
  EXPECT_EQ(hopeless.options.quality, Quality::draft);
  EXPECT_GT(hopeless.measured_ms.at(0), 1e-3);
}

TEST_F(TimeBudgetOfFrames, PosesThatSeeNothingOrAreRejectedMeasureNothing) {
  geodesy::Geodetic far = map.center();
  far.lat_rad += 0.1;
  far.height_m = 50;
  const std::vector<CameraPose> poses = {look_down(far, geodesy::Degrees{0})};
  Renderer renderer;
  for (const OffMap off_map : {OffMap::Mask, OffMap::Reject}) {
    const auto fitted = fit_time_budget(renderer, scene, camera, poses, {.off_map = off_map}, 1e3).value();
    EXPECT_EQ(fitted.probes, 0u);
    EXPECT_EQ(fitted.options.quality, Quality::draft);
    EXPECT_EQ(fitted.options.off_map, off_map);
  }
  EXPECT_FALSE(fit_time_budget(renderer, scene, camera, poses, {.geometry_tolerance_px = -1}, 10))
      << "what else is wrong is said too";
}

TEST_F(TimeBudgetOfFrames, FramesSayThatTheyWereAdapted) {
  Renderer renderer;
  const CameraPose pose = test::over_centre(map, 40);
  EXPECT_FALSE(renderer.render(scene, camera, pose)->truth().adaptive);
  EXPECT_TRUE(renderer.render(scene, camera, pose, {.adaptive = true})->truth().adaptive);
}

}  // namespace
}  // namespace nadir::render

// The reference filter is nearer to what it stands for than what it judges is to it.
#include <gtest/gtest.h>

#include "convergence.h"
#include "support/temporary_folder.h"

namespace nadir::bench {
namespace {

TEST(Reference, ConvergesAsMeansOfABilinearSurfaceDoAndIsNearerThanWhatItJudges) {
  const test::TemporaryFolder folder;
  RunOptions options;
  options.scratch = folder.path().string();
  for (const Pose& pose : poses()) {
    if (pose.wide) continue;
    const auto view = FineView::make(options, pose, 96, 72).value();
    const auto with = [&](double samples) { return view->render(reference_with(samples)).value(); };
    const auto reference = with(2), doubled = with(4), quadrupled = with(8), finest = with(finest_reference);

    // Between texels' centres the surface is smooth and at them its slope jumps: the midpoint rule errs there by a
    // number of steps of h that is fixed, each by the jump times h^2 / 8 at most. A quarter with twice the samples, a
    // little less where errors of many texels cancel.
    const double fall = difference(reference, doubled) / difference(doubled, quadrupled);
    EXPECT_GT(fall, 3.5) << pose.name;
    EXPECT_LT(fall, 6.5) << pose.name;

    const double error = difference(reference, finest);
    EXPECT_GT(error, 0) << pose.name;
    EXPECT_LT(error, 0.03) << pose.name;
    for (const auto quality : {render::Quality::draft, render::Quality::balanced, render::Quality::best})
      EXPECT_LT(error, difference(view->render({.quality = quality}).value(), finest) / 3)
          << pose.name << ", " << to_string(quality);
  }
}

TEST(Reference, TakesNoFewerSamplesThanItsDefinitionAsks) {
  const test::TemporaryFolder folder;
  RunOptions options;
  options.scratch = folder.path().string();
  const auto view = FineView::make(options, poses()[0], 32, 24).value();
  EXPECT_EQ(view->render(reference_with(0.5)).value(), view->render({.filter = render::Filter::Reference}).value());
}

}  // namespace
}  // namespace nadir::bench

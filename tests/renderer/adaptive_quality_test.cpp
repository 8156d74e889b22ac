// Ways of sampling that follow the time of frames, by a clock that each test makes up.
#include "nadir/render/adaptive_quality.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace nadir::render {
namespace {

constexpr std::array<double, 8> costs = {1, 1.6, 2.2, 3.1, 4.6, 6.4, 10.5, 16};  // of the ladder's ways; rising

/// A flight: how heavy frames are over time, and what was chosen for each.
struct Flight {
  double budget_ms = 10;
  std::array<double, 8> cost = costs;
  std::vector<std::size_t> rungs = {};
  std::vector<double> ms = {};

  /// Renders `frames` more, of `weight` times the usual cost, give or take `noise` of it.
  void fly(AdaptiveQuality& adaptive, int frames, double weight, double noise = 0) {
    for (int i = 0; i < frames; ++i) {
      rungs.push_back(adaptive.rung());
      const double u = std::uniform_real_distribution<double>(-1, 1)(random);
      ms.push_back(cost[adaptive.rung()] * weight * (1 + noise * u));
      adaptive.note(ms.back());
    }
  }
  int late(std::size_t from) const {
    return static_cast<int>(std::count_if(ms.begin() + static_cast<std::ptrdiff_t>(from), ms.end(),
                                          [&](double t) { return t > budget_ms; }));
  }
  int changes(std::size_t from) const {
    int n = 0;
    for (std::size_t i = std::max<std::size_t>(from, 1); i < rungs.size(); ++i) n += rungs[i] != rungs[i - 1];
    return n;
  }
  std::mt19937 random{1};
};

/// As resolved on the flight's first frames; `measured`: whether the ladder was.
FittedQuality fitted(const Flight& flight, std::size_t rung, bool measured = true) {
  FittedQuality f{.budget_ms = flight.budget_ms, .rung = rung, .probes = 1};
  if (measured)
    f.measured_ms.assign(flight.cost.begin(),
                         flight.cost.begin() + std::min<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(rung) + 2, 8));
  return f;
}

TEST(AdaptiveQuality, ItBeginsWithWhatWasFittedAndDeclaresItself) {
  const AdaptiveQuality adaptive(fitted({}, 5));
  const RenderOptions options = adaptive.options({.filter = Filter::Nearest, .max_error = 3, .fill_value = 5});
  EXPECT_TRUE(options.adaptive);
  EXPECT_EQ(options.quality, Quality::balanced);
  EXPECT_EQ(options.oversampling, 4.1);
  EXPECT_FALSE(options.filter || options.max_error);
  EXPECT_EQ(options.fill_value, 5);
}

TEST(AdaptiveQuality, ASteadyFlightChangesNothing) {
  Flight flight;
  AdaptiveQuality adaptive(fitted(flight, 5));
  flight.fly(adaptive, 500, 1);
  EXPECT_EQ(flight.changes(0), 0);
  EXPECT_EQ(flight.rungs.back(), 5u);
}

TEST(AdaptiveQuality, FramesTenTimesAsHeavyAreBackInTimeWithinTwo) {
  for (const bool measured : {true, false})
    for (const std::size_t start : {2u, 4u, 5u}) {
      Flight flight;
      AdaptiveQuality adaptive(fitted(flight, start, measured));
      flight.fly(adaptive, 20, 0.99);
      const std::size_t jump = flight.ms.size();
      flight.fly(adaptive, 300, 9.9);
      EXPECT_GT(flight.ms[jump], flight.budget_ms) << "it did jump";
      EXPECT_LE(flight.late(jump), 2);
      EXPECT_LE(flight.late(jump + 2), 0);
      EXPECT_LE(flight.changes(jump), 2) << "and stays where it fits";
      EXPECT_EQ(flight.rungs.back(), 0u);
    }
}

TEST(AdaptiveQuality, AfterAPassingLoadItComesBackStepByStep) {
  Flight flight;
  AdaptiveQuality adaptive(fitted(flight, 5));
  flight.fly(adaptive, 20, 1);
  flight.fly(adaptive, 1, 10);  // one slow frame
  flight.fly(adaptive, 200, 1);
  EXPECT_EQ(flight.late(0), 1);
  for (std::size_t i = 22; i < flight.rungs.size(); ++i) EXPECT_LE(flight.rungs[i], flight.rungs[i - 1] + 1);
  EXPECT_EQ(flight.rungs.back(), 5u);
}

TEST(AdaptiveQuality, NoiseAtTheBudgetMakesNoOscillation) {
  for (const double weight : {0.5, 0.8, 0.97, 1.2, 1.5, 2.1, 3.2}) {
    Flight flight;
    AdaptiveQuality adaptive(fitted(flight, 3));
    flight.fly(adaptive, 2000, weight, 0.15);
    EXPECT_LE(flight.changes(200), 2) << weight;
    EXPECT_LE(flight.late(200), 1) << weight;
  }
}

TEST(AdaptiveQuality, ASecondLateFrameInARowLeadsToTheCheapest) {
  // It believes that each way takes four times as long as the one before; the finer ones are nearly alike
  Flight flight;
  flight.cost = {1, 5.5, 6, 6.5, 7, 7.5, 8, 8.5};
  FittedQuality belief = fitted(flight, 7);
  belief.measured_ms = {1, 2, 4, 16, 64, 256, 1024, 4096};
  AdaptiveQuality adaptive(belief);
  flight.fly(adaptive, 20, 1);
  flight.fly(adaptive, 5, 5);
  EXPECT_GT(flight.ms[21], flight.budget_ms) << "the first way down was too short";
  EXPECT_EQ(flight.rungs[22], 0u);
  EXPECT_EQ(flight.late(22), 0);
}

TEST(AdaptiveQuality, AHeavyFrameNowAndThenIsKeptInMind) {
  Flight flight;
  AdaptiveQuality adaptive(fitted(flight, 5));
  for (int i = 0; i < 100; ++i) {
    flight.fly(adaptive, 1, 1.5);
    flight.fly(adaptive, 4, 0.8);
  }
  EXPECT_LE(flight.changes(0), 2);
  EXPECT_LE(flight.late(0), 1);
}

TEST(AdaptiveQuality, AWayThatProvesWrongAgainAndAgainIsTriedEverMoreRarely) {
  // Each fourth frame of the finer ways is late, and the first one after the way up never is
  Flight flight;
  AdaptiveQuality adaptive(fitted(flight, 5));
  int since = 0;
  for (int i = 0; i < 2000; ++i) {
    const bool finer = adaptive.rung() > 5;
    since = finer ? since + 1 : 0;
    flight.cost[6] = since % 4 == 3 ? 10.5 : 7.5;
    flight.cost[5] = 5;
    flight.fly(adaptive, 1, 1);
  }
  EXPECT_GE(flight.late(0), 2) << "it did try";
  EXPECT_LE(flight.late(0), 10);
  EXPECT_LE(flight.late(1000), 2);
}

TEST(AdaptiveQuality, WhatANextWayCostsIsLearned) {
  // It believes that oversampling 6.1 costs little more than 4.1, and it costs five times as much
  Flight flight;
  flight.cost = {1, 1.5, 2, 3, 4, 5, 25, 40};
  FittedQuality belief = fitted(flight, 5);
  belief.measured_ms = {1, 1.5, 2, 3, 4, 5, 5.5, 6};
  AdaptiveQuality adaptive(belief);
  flight.fly(adaptive, 1000, 1);
  EXPECT_GE(flight.late(0), 1);
  EXPECT_LE(flight.late(0), 4);
  EXPECT_EQ(flight.late(200), 0) << "no mistake is made again and again";

  // And the other way round: not tried yet, twice the samples are expected to cost twice as much; they hardly do
  Flight cheap;
  cheap.cost = {4, 4.1, 4.2, 4.4, 4.6, 4.8, 5, 5.2};
  AdaptiveQuality careful(fitted(cheap, 1, false));
  cheap.fly(careful, 300, 0.8);
  EXPECT_EQ(cheap.rungs.back(), 7u);
  EXPECT_EQ(cheap.late(0), 0);
}

TEST(AdaptiveQuality, OneSlowFrameAfterAWayUpDoesNotForbidItForGood) {
  Flight flight;
  AdaptiveQuality adaptive(fitted(flight, 5));
  while (adaptive.rung() == 5 && flight.ms.size() < 100) flight.fly(adaptive, 1, 0.6);
  flight.fly(adaptive, 1, 6);
  EXPECT_LT(adaptive.rung(), 5u);
  flight.fly(adaptive, 200, 0.6);
  EXPECT_EQ(flight.rungs.back(), 6u);
}

TEST(AdaptiveQuality, ABudgetTooSmallForAnythingStaysWithTheCheapest) {
  Flight flight{.budget_ms = 1e-3};
  AdaptiveQuality adaptive(fitted(flight, 0));
  flight.fly(adaptive, 100, 1);
  EXPECT_EQ(flight.changes(0), 0);
  EXPECT_EQ(flight.rungs.back(), 0u);
}

TEST(AdaptiveQuality, FramesThatCostNothingLeadToTheFinestAndNoFurther) {
  Flight flight;
  AdaptiveQuality adaptive(FittedQuality{.budget_ms = 10});
  flight.fly(adaptive, 300, 0);
  EXPECT_EQ(flight.rungs.back(), 7u);
  const std::size_t over_the_map = flight.ms.size();
  flight.fly(adaptive, 300, 1.5);
  EXPECT_LE(flight.late(over_the_map), 2);
}

}  // namespace
}  // namespace nadir::render

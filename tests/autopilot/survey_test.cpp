#include "nadir/sim/survey.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace nadir::sim {
namespace {

using Eigen::Vector2d;
constexpr double pi = std::numbers::pi;

/// How often a place is seen by exposures along all lines, `spacing_m` apart, each line with a phase of its own.
class Exposures {
 public:
  Exposures(const SurveyPlan& plan, const SurveyOrder& order, std::mt19937_64& random) : seen_(order.seen_m) {
    std::uniform_real_distribution<double> phase(0, plan.exposure_spacing_m);
    for (std::size_t i = 0; i + 1 < plan.waypoints.size(); i += 2) {
      const Waypoint &a = plan.waypoints[i], &b = plan.waypoints[i + 1];
      const Vector2d from(a.north_m, a.east_m), to(b.north_m, b.east_m), along = (to - from).normalized();
      EXPECT_NEAR(std::cos(*a.course_rad - std::atan2(along.y(), along.x())), 1, 1e-12) << "courses lie along lines";
      const double begin = order.lead_in_m, end = (to - from).norm() - order.lead_out_m;
      for (double s = begin + phase(random); s <= end; s += plan.exposure_spacing_m)
        places_.push_back({from + s * along, along});
    }
  }
  int count(const Vector2d& p) const {
    int n = 0;
    for (const auto& [place, along] : places_) {
      const Vector2d off = p - place;
      n += seen_.contains(Vector2d(off.dot(along), off.y() * along.x() - off.x() * along.y()));
    }
    return n;
  }
  std::size_t size() const { return places_.size(); }

 private:
  Eigen::AlignedBox2d seen_;
  std::vector<std::pair<Vector2d, Vector2d>> places_;
};

Area random_area(std::mt19937_64& random, int i) {
  std::uniform_real_distribution<double> radius(300, 900), angle(0, 2 * pi);
  if (i % 4 == 0) return Area::rectangle({100, -50}, radius(random), radius(random), angle(random));
  if (i % 4 == 1) return Area::disc({0, 200}, radius(random));
  std::vector<Vector2d> corners;  // a star: not convex as a rule
  const int n = 4 + i % 5;
  for (int k = 0; k < n; ++k) {
    const double at = 2 * pi * k / n, r = radius(random);
    corners.emplace_back(r * std::cos(at), r * std::sin(at));
  }
  return Area::polygon(corners).value();
}

TEST(Survey, EveryPointOfTheAreaIsSeenAsOftenAsTheOverlapsPromise) {
  std::mt19937_64 random(5);
  int fewest_beyond_promise = 1000;
  for (int i = 0; i < 48; ++i) {
    const Area area = random_area(random, i);
    SurveyOrder order;
    const double ahead = i % 3 == 0 ? 60 : 90;  // looking straight down, or a little ahead and to the right
    order.seen_m = {Vector2d(ahead - 120, i % 2 ? -80 : -100), Vector2d(ahead, i % 2 ? 120 : 100)};
    order.forward_overlap = std::array{0.0, 0.3, 0.6, 0.8}[static_cast<std::size_t>(i % 4)];
    order.side_overlap = std::array{0.0, 0.3, 0.55, 0.7}[static_cast<std::size_t>((i / 4) % 4)];
    order.lead_in_m = 30 * (i % 3), order.lead_out_m = 20;
    if (i % 5 == 0) order.heading_rad = 0.3 * i;
    const SurveyPlan plan = plan_survey(area, order).value();
    const Exposures exposures(plan, order, random);
    int fewest = 1000;
    const auto box = area.bounds();
    for (double n = box.min().x(); n <= box.max().x(); n += 23)
      for (double e = box.min().y(); e <= box.max().y(); e += 23)
        if (area.contains({n, e})) fewest = std::min(fewest, exposures.count({n, e}));
    for (const Vector2d& corner : area.corners())  // a hair within, where the last digit decides
      fewest = std::min(fewest, exposures.count(corner + 1e-6 * (area.bounds().center() - corner)));
    EXPECT_GE(fewest, plan.seen_at_least) << i;
    fewest_beyond_promise = std::min(fewest_beyond_promise, fewest - plan.seen_at_least);
  }
  EXPECT_EQ(fewest_beyond_promise, 0) << "the promise is kept without waste somewhere";
}

TEST(Survey, ARectangleIsFlownAlongItsLengthWithTheLinesThatItNeeds) {
  const double heading = 0.4;
  const Area area = Area::rectangle({0, 0}, 2000, 700, heading);
  SurveyOrder order;
  order.seen_m = {Vector2d(-50, -100), Vector2d(50, 100)};
  order.side_overlap = 0.25;  // 150 m apart at most: 700 m take one of 200 m and four more of 125
  const SurveyPlan plan = plan_survey(area, order).value();
  EXPECT_EQ(plan.lines, 5);
  EXPECT_NEAR(plan.line_spacing_m, 125, 1e-9);
  EXPECT_NEAR(plan.exposure_spacing_m, 40, 1e-12);
  EXPECT_EQ(plan.seen_at_least, 2);
  EXPECT_NEAR(std::abs(std::cos(plan.heading_rad - heading)), 1, 1e-12);
  ASSERT_EQ(plan.waypoints.size(), 10u);
  EXPECT_NEAR(std::hypot(plan.waypoints[1].north_m - plan.waypoints[0].north_m,
                         plan.waypoints[1].east_m - plan.waypoints[0].east_m),
              2100, 1e-9)
      << "half of what is seen before and after";
  for (std::size_t i = 2; i < 10; i += 2)
    EXPECT_NEAR(std::abs(std::remainder(*plan.waypoints[i].course_rad - *plan.waypoints[i - 1].course_rad, 2 * pi)), pi,
                1e-9)
        << "to and fro";
}

TEST(Survey, TheBestHeadingIsNoWorseThanAnyOther) {
  std::mt19937_64 random(6);
  for (int i = 0; i < 40; ++i) {
    const Area area = random_area(random, i);
    SurveyOrder order;
    order.seen_m = {Vector2d(-20, -30), Vector2d(20, 30)};
    const int best = plan_survey(area, order)->lines;
    for (int k = 0; k < 180; ++k) {
      order.heading_rad = k * pi / 180;
      EXPECT_GE(plan_survey(area, order)->lines, best) << i << " at " << k;
    }
  }
}

TEST(Survey, BeginsAtTheNearestOfItsFourEnds) {
  const Area area = Area::rectangle({0, 0}, 1000, 800, 0);
  SurveyOrder order;
  order.seen_m = {Vector2d(-50, -100), Vector2d(50, 100)};
  for (const double north : {-1.0, 1.0})
    for (const double east : {-1.0, 1.0}) {
      order.from = Vector2d(5000 * north, 5000 * east);
      const Waypoint first = plan_survey(area, order)->waypoints[0];
      EXPECT_GT(first.north_m * north, 0);
      EXPECT_GT(first.east_m * east, 0);
      EXPECT_NEAR(*first.course_rad, north < 0 ? 0 : pi, 1e-9) << "into the area";
    }
}

/// How far turns between lines lead beyond the lines' ends, and how long the ways between are.
struct Turns {
  double beyond_m = 0, length_m = 0;
};

Turns turns_of(const SurveyPlan& plan, double radius_m) {
  const std::vector<MissionItem> items(plan.waypoints.begin(), plan.waypoints.end());
  const Mission mission = Mission::create(plan.waypoints.front(), std::span(items).subspan(1), radius_m).value();
  const Vector2d along(std::cos(plan.heading_rad), std::sin(plan.heading_rad));
  const auto at = [&](double north_m, double east_m) { return Vector2d(north_m, east_m).dot(along); };
  double low = INFINITY, high = -INFINITY;
  for (const Waypoint& w : plan.waypoints)
    low = std::min(low, at(w.north_m, w.east_m)), high = std::max(high, at(w.north_m, w.east_m));
  Turns out;
  for (const PlannedPoint& p : planned_points(mission, 5)) {
    if (p.length_m == 0) continue;  // the last circle
    out.beyond_m = std::max({out.beyond_m, low - at(p.north_m, p.east_m), at(p.north_m, p.east_m) - high});
    if (p.item % 2 == 1) out.length_m += p.length_m;
  }
  return out;
}

TEST(Survey, LinesCloserThanTwoRadiiAreFlownInAnOrderWithoutTightTurns) {
  constexpr double radius_m = 150;
  for (int lines = 2; lines <= 60; ++lines) {
    const Area area = Area::rectangle({0, 0}, 1500, 40.0 * lines, 0);
    SurveyOrder order;
    order.seen_m = {Vector2d(-50, -20), Vector2d(50, 20)};
    order.side_overlap = 0;
    order.heading_rad = 0;
    const SurveyPlan plain = plan_survey(area, order).value();
    order.turn_radius_m = radius_m;
    const SurveyPlan plan = plan_survey(area, order).value();
    ASSERT_EQ(plan.lines, lines);
    std::vector<int> flown;  // by their place from west to east
    double closest_m = INFINITY;
    for (std::size_t i = 0; i < plan.waypoints.size(); i += 2) {
      const double east = plan.waypoints[i].east_m;
      if (i > 0) closest_m = std::min(closest_m, std::abs(east - plan.waypoints[i - 2].east_m));
      flown.push_back(static_cast<int>(std::lround((east + 20.0 * lines - 20) / 40)));
    }
    std::sort(flown.begin(), flown.end());
    for (int i = 0; i < lines; ++i) ASSERT_EQ(flown[static_cast<std::size_t>(i)], i) << "each line once";
    const Turns turns = turns_of(plan, radius_m), swings = turns_of(plain, radius_m);
    if (lines >= 17) {  // two halves of eight lines 40 m apart hold turns of 300 m
      EXPECT_GE(closest_m, 2 * radius_m) << lines;
      EXPECT_LE(turns.beyond_m, radius_m + 1e-6) << lines;
    }
    EXPECT_LE(turns.length_m, swings.length_m + 1e-6) << lines;
    if (lines >= 3) {
      EXPECT_GT(swings.beyond_m, 1.5 * radius_m);
    }
  }
}

TEST(Survey, LinesFartherApartThanTwoRadiiAreFlownOneAfterTheOther) {
  const Area area = Area::rectangle({0, 0}, 1500, 1200, 0);
  SurveyOrder order;
  order.seen_m = {Vector2d(-50, -60), Vector2d(50, 60)};
  order.side_overlap = 0;
  order.heading_rad = 0;
  order.turn_radius_m = 60;
  const SurveyPlan plan = plan_survey(area, order).value();
  for (std::size_t i = 2; i < plan.waypoints.size(); i += 2)
    EXPECT_NEAR(std::abs(plan.waypoints[i].east_m - plan.waypoints[i - 2].east_m), plan.line_spacing_m, 1e-9);
}

TEST(Survey, WhatCannotBeIsSaid) {
  const Area area = Area::rectangle({0, 0}, 1000, 800, 0);
  SurveyOrder order;
  const auto message = [&] {
    const auto plan = plan_survey(area, order);
    return plan ? std::string("accepted") : plan.error().message;
  };
  EXPECT_NE(message().find("sees no rectangle"), std::string::npos);
  order.seen_m = {Vector2d(-50, -1e-3), Vector2d(50, 1e-3)};
  EXPECT_NE(message().find("more than 10000 lines"), std::string::npos);
  order.seen_m = {Vector2d(-50, -100), Vector2d(50, 100)};
  EXPECT_EQ(message(), "accepted");
  for (const double bad : {-0.1, 0.96, 1.0, std::nan("")}) {
    order.side_overlap = bad;
    EXPECT_NE(message().find("an overlap from 0 to 0.95"), std::string::npos);
  }
}

TEST(Area, PolygonsThatAreNoneAreRefused) {
  const auto said = [](std::vector<Vector2d> corners) {
    const auto area = Area::polygon(std::move(corners));
    return area ? std::string("accepted") : area.error().message;
  };
  EXPECT_EQ(said({{0, 0}, {10, 0}, {10, 10}, {0, 10}}), "accepted");
  EXPECT_EQ(said({{0, 0}, {10, 0}, {2, 2}, {0, 10}}), "accepted");
  EXPECT_NE(said({{0, 0}, {10, 0}}).find("at least three corners"), std::string::npos);
  EXPECT_NE(said({{0, 0}, {10, 10}, {10, 0}, {0, 10}}).find("from corner 1 and from corner 3 cross"),
            std::string::npos);
  EXPECT_NE(said({{0, 0}, {10, 0}, {5, 0}}).find("cross or touch"), std::string::npos);
  EXPECT_NE(said({{0, 0}, {10, 0}, {10, 10}, {5, 0}}).find("cross or touch"), std::string::npos);
  EXPECT_NE(said({{0, 0}, {10, 0}, {10, 0}}).find("corners 2 and 3 are one"), std::string::npos);
  EXPECT_NE(said({{0, 0}, {10, NAN}, {10, 10}}).find("corner 2"), std::string::npos);
}

TEST(Area, ContainsKeepsItsMargin) {
  const Area ell = Area::polygon({{0, 0}, {100, 0}, {100, 50}, {50, 50}, {50, 100}, {0, 100}}).value();
  EXPECT_TRUE(ell.contains({25, 75}));
  EXPECT_FALSE(ell.contains({75, 75}));
  EXPECT_TRUE(ell.contains({45, 45}, 7)) << "the inner corner is 7.07 m away";
  EXPECT_FALSE(ell.contains({45, 45}, 7.2));
  const Area disc = Area::disc({10, 10}, 50);
  EXPECT_TRUE(disc.contains({10, 55}, 4.9));
  EXPECT_FALSE(disc.contains({10, 55}, 5.1));
}

}  // namespace
}  // namespace nadir::sim

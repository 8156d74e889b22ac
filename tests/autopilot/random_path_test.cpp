#include "nadir/sim/random_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace nadir::sim {
namespace {

using Eigen::Vector2d;
constexpr double pi = std::numbers::pi;

const Area kite = Area::polygon({{-1500, 0}, {0, -900}, {2000, 0}, {0, 1200}}).value();
const RandomPathOrder order{.height_m = {80, 180},
                            .turn_radius_m = {100, 250},
                            .max_slope = 0.08,
                            .airspeed_mps = std::pair(22.0, 28.0),
                            .margin_m = 20,
                            .length_m = 40000};
const Waypoint start{0, 0, 100, 0.5};

TEST(RandomPath, KeepsToItsAreaBandCurvatureSlopeAndSpeeds) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const auto waypoints = random_path(kite, order, start, RandomStream(seed, "random/plane")).value();
    const std::vector<MissionItem> items(waypoints.begin(), waypoints.end());
    const Mission mission = Mission::create(start, items, order.turn_radius_m.second).value();
    double length = 0, most_curve = 0, most_slope = 0, low = 1e9, high = -1e9, nearest_course = 10;
    const auto points = planned_points(mission, 5);
    for (const PlannedPoint& p : points) {
      EXPECT_TRUE(kite.contains({p.north_m, p.east_m}, order.margin_m)) << p.north_m << " " << p.east_m;
      length += p.length_m;
      most_curve = std::max(most_curve, std::abs(p.curve_per_m));
      most_slope = std::max(most_slope, std::abs(p.slope));
      low = std::min(low, p.height_m), high = std::max(high, p.height_m);
      nearest_course = std::min(nearest_course, std::abs(std::remainder(p.course_rad - 2, 2 * pi)));
      if (&p != &points.back()) {
        EXPECT_LT(std::abs(std::remainder((&p)[1].course_rad - p.course_rad, 2 * pi)), 5.01 / 100)
            << "the course never jumps";
      }
    }
    EXPECT_GE(length, order.length_m);
    EXPECT_LE(most_curve, 1.0 / 100 + 1e-12);
    EXPECT_GT(most_curve, 1.0 / 120) << "the limits are come near to";
    EXPECT_LE(most_slope, 0.08 + 1e-9);
    EXPECT_GT(most_slope, 0.04);
    EXPECT_GE(low, 80);
    EXPECT_LE(high, 180);
    EXPECT_LT(low, 100);
    EXPECT_GT(high, 160);
    EXPECT_LT(nearest_course, 0.1) << "all directions are flown";
    for (const Waypoint& w : waypoints) {
      EXPECT_GE(*w.airspeed_mps, 22);
      EXPECT_LE(*w.airspeed_mps, 28);
    }
  }
}

TEST(RandomPath, TheSameSeedGivesTheSamePathAndALongerOneGoesOn) {
  const auto path = [&](std::uint64_t seed, double length_m) {
    RandomPathOrder of_length = order;
    of_length.length_m = length_m;
    return random_path(kite, of_length, start, RandomStream(seed, "random/plane")).value();
  };
  const auto same = [](const Waypoint& a, const Waypoint& b) {
    return a.north_m == b.north_m && a.east_m == b.east_m && a.height_m == b.height_m && a.course_rad == b.course_rad &&
           a.turn_radius_m == b.turn_radius_m && a.airspeed_mps == b.airspeed_mps;
  };
  const auto a = path(7, 20000), b = path(7, 20000), longer = path(7, 40000), other = path(8, 20000);
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GT(longer.size(), a.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(same(a[i], b[i]) && same(a[i], longer[i])) << i;
  EXPECT_FALSE(same(a[0], other[0]));
}

TEST(RandomPath, FromOutsideOnlyTheWayInMayLieOutside) {
  const Waypoint outside{5000, 5000, 100, 0.0};
  const auto waypoints = random_path(kite, order, outside, RandomStream(3, "random/plane")).value();
  const std::vector<MissionItem> items(waypoints.begin(), waypoints.end());
  const Mission mission = Mission::create(outside, items, order.turn_radius_m.second).value();
  for (const PlannedPoint& p : planned_points(mission, 5))
    if (p.item > 0) {
      EXPECT_TRUE(kite.contains({p.north_m, p.east_m}, order.margin_m));
    }
}

TEST(RandomPath, TightAreasAreFlownByGoingBackOutOfDeadEnds) {
  // Less than a radius to spare, and turns that lead to where no other does
  RandomPathOrder tight = order;
  tight.turn_radius_m = {100, 200};
  tight.length_m = 20000;
  const std::pair<const char*, Area> areas[] = {
      {"a disc", Area::disc({0, 0}, 290)},
      {"a strip", Area::rectangle({0, 0}, 1600, 480, 0.3)},
      {"an ell", Area::polygon({{0, 0}, {1400, 0}, {1400, 500}, {500, 500}, {500, 1400}, {0, 1400}}).value()}};
  for (const auto& [name, area] : areas)
    for (std::uint64_t seed = 0; seed < 8; ++seed) {
      const auto path = random_path(area, tight, {250, 250, 100, 0.5}, RandomStream(seed, "random/plane"));
      ASSERT_TRUE(path) << name << ": " << path.error().message;
      const std::vector<MissionItem> items(path->begin(), path->end());
      const Mission mission = Mission::create(path->front(), std::span(items).subspan(1), 200).value();
      for (const PlannedPoint& p : planned_points(mission, 5))
        ASSERT_TRUE(area.contains({p.north_m, p.east_m}, tight.margin_m)) << name;
      const auto again = random_path(area, tight, {250, 250, 100, 0.5}, RandomStream(seed, "random/plane"));
      EXPECT_EQ(again->back().north_m, path->back().north_m);
    }
}

TEST(RandomPath, AnAreaWithoutRoomForItsTurnsIsSaidInNumbers) {
  RandomPathOrder wide = order;
  wide.turn_radius_m = {900, 1000};
  const auto said = [&](const Area& area) {
    const auto path = random_path(area, wide, start, RandomStream(1, "random/plane"));
    return path ? std::string("found") : path.error().message;
  };
  EXPECT_EQ(said(Area::rectangle({0, 0}, 5000, 1800, 0.2)),
            "turns of 1000 m and a margin of 20 m need a place 2040 m wide, and the area is 1800 m wide at its widest: "
            "take a radius of at most 879 m, or a larger area");
}

TEST(Area, ItsWidestPlaceIsKnown) {
  EXPECT_NEAR(Area::rectangle({100, 30}, 900, 400, 0.7).widest_m(), 200, 0.3);
  EXPECT_EQ(Area::disc({5, 5}, 70).widest_m(), 70);
  // Of the inner corner's ell: the circle that touches both outer edges and the inner corner, r = (50 - r) sqrt(2) ...
  const Area ell = Area::polygon({{0, 0}, {100, 0}, {100, 50}, {50, 50}, {50, 100}, {0, 100}}).value();
  EXPECT_NEAR(ell.widest_m(), 50 * std::numbers::sqrt2 / (1 + std::numbers::sqrt2), 0.05);
  // Of a right triangle: (a + b - c) / 2
  EXPECT_NEAR(Area::polygon({{0, 0}, {300, 0}, {0, 400}})->widest_m(), 100, 0.15);
  // Hardly an inside, far from the middle of its box
  EXPECT_NEAR(Area::polygon({{0, 0}, {1000, 0}, {1000, 1000}, {999.9, 0.1}})->widest_m(), 0.05, 0.01);
}

}  // namespace
}  // namespace nadir::sim

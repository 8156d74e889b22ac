#include "nadir/sim/dubins.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

namespace nadir::sim {
namespace {

using Eigen::Vector2d;
constexpr double pi = std::numbers::pi;

struct Pose {
  Vector2d place;
  double course = 0;
};

/// A pose moved on by a turn (curve +1 right, -1 left, 0 straight; radius 1) of so many radians or metres.
Pose moved(const Pose& from, int curve, double amount) {
  const double c = from.course;
  if (curve == 0) return {from.place + amount * Vector2d(std::cos(c), std::sin(c)), c};
  const double to = c + curve * amount;
  return {from.place + curve * Vector2d(std::sin(to) - std::sin(c), std::cos(c) - std::cos(to)), to};
}

WayEnd end_of(const Pose& p) { return WayEnd::pose(p.place, p.course); }

/// The length of the best of all ways whose first and last turns are among `n` angles each, straight between: found by
/// trying, without any formula for tangents. Only ways that end within `miss` of the goal's place count; the rest of
/// their error is added as if flown.
double tried_length(const Pose& from, const Pose& to, int n, double miss) {
  double best = std::numeric_limits<double>::infinity();
  for (const int first : {1, -1})
    for (const int last : {1, -1})
      for (int i = 0; i < n; ++i) {
        const double a = 2 * pi * i / n;
        const Pose left = moved(from, first, a);
        // The last turn is known once the course between is; where it begins follows by turning back from the goal
        double b = std::fmod(last * (to.course - left.course), 2 * pi);
        if (b < 0) b += 2 * pi;
        const Pose arrived = moved(to, last, -b);
        const Vector2d between = arrived.place - left.place, along(std::cos(left.course), std::sin(left.course));
        const double straight = between.dot(along);
        if (straight < 0 || (between - straight * along).norm() > miss) continue;
        best = std::min(best, a + straight + b);
      }
  // Three turns: the middle one of any angle, to the other side
  for (const int side : {1, -1})
    for (int i = 0; i < n; ++i) {
      const double a = 2 * pi * i / n;
      const Pose left = moved(from, side, a);
      for (int j = n / 2; j < n; ++j) {
        const double m = 2 * pi * j / n;
        const Pose then = moved(left, -side, m);
        double b = std::fmod(side * (to.course - then.course), 2 * pi);
        if (b < 0) b += 2 * pi;
        const Pose ended = moved(then, side, b);
        if ((ended.place - to.place).norm() < miss) best = std::min(best, a + m + b);
      }
    }
  return best;
}

/// Where the pieces lead, flown one after the other: checks each begins where the last one ended.
Pose flown(const Pose& from, const Way& way) {
  Pose at = from;
  for (const Path& piece : way.pieces) {
    if (const auto* line = std::get_if<StraightPath>(&piece)) {
      EXPECT_NEAR((line->from - at.place).norm(), 0, 1e-6);
      const Vector2d whole = line->to - line->from;
      EXPECT_NEAR(std::remainder(std::atan2(whole.y(), whole.x()) - at.course, 2 * pi), 0, 1e-5);
      at.place = line->to;
    } else {
      const auto& arc = std::get<CirclePath>(piece);
      const double sense = arc.clockwise ? 1 : -1;
      const auto on = [&](double bearing) -> Vector2d {
        return arc.center + arc.radius_m * Vector2d(std::cos(bearing), std::sin(bearing));
      };
      EXPECT_NEAR((on(arc.from_rad) - at.place).norm(), 0, 1e-6);
      EXPECT_NEAR(std::remainder(arc.from_rad + sense * pi / 2 - at.course, 2 * pi), 0, 1e-6);
      at = {on(arc.from_rad + sense * arc.sweep_rad), at.course + sense * arc.sweep_rad};
    }
  }
  return at;
}

Pose random_pose(std::mt19937_64& random, double reach) {
  std::uniform_real_distribution<double> place(-reach, reach), course(-pi, pi);
  const double n = place(random), e = place(random);
  return {{n, e}, course(random)};
}

TEST(Dubins, WaysLeadToTheirEndWithoutAJumpAndAllSixWordsOccur) {
  std::mt19937_64 random(1);
  std::map<std::string, int> words;
  for (int i = 0; i < 20000; ++i) {
    const Pose from = random_pose(random, 3), to = random_pose(random, 3);
    const Way way = shortest_way(end_of(from), end_of(to), 1).value();
    const Pose end = flown(from, way);
    EXPECT_NEAR((end.place - to.place).norm(), 0, 1e-6);
    EXPECT_NEAR(std::remainder(end.course - to.course, 2 * pi), 0, 1e-6);
    double sum = 0;
    for (const Path& piece : way.pieces) sum += length_m(piece);
    EXPECT_NEAR(sum, way.length_m, 1e-5);
    EXPECT_GE(way.length_m, (to.place - from.place).norm() - 1e-9);
    ++words[way.word];
  }
  for (const char* word : {"RSR", "RSL", "LSR", "LSL", "RLR", "LRL"}) EXPECT_GT(words[word], 100) << word;
  EXPECT_EQ(words.size(), 6u);
}

TEST(Dubins, NoWayFoundByTryingIsShorterAndSomeAreAsShort) {
  // Angles apart by 2 pi / n end off the goal by up to a few of those, and are as much shorter at most.
  std::mt19937_64 random(2);
  constexpr int n = 400;
  constexpr double miss = 0.05, slack = 4 * miss;
  double closest = 1e9;
  int found = 0;
  for (int i = 0; i < 60; ++i) {
    const Pose from = random_pose(random, 2), to = random_pose(random, 2);
    const double shortest = shortest_way(end_of(from), end_of(to), 1)->length_m,
                 tried = tried_length(from, to, n, miss);
    EXPECT_GE(tried, shortest - slack) << i;
    found += tried < shortest + slack;
    closest = std::min(closest, tried - shortest);
  }
  EXPECT_GT(found, 57) << "the trials reach the shortest way nearly always";
  EXPECT_LT(closest, slack);
}

TEST(Dubins, LengthsAreThoseOfSymmetricProblems) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 2000; ++i) {
    const Pose a = random_pose(random, 4), b = random_pose(random, 4);
    const double length = shortest_way(end_of(a), end_of(b), 1)->length_m;
    const auto mirrored = [](const Pose& p) { return Pose{{p.place.x(), -p.place.y()}, -p.course}; };
    const auto back = [](const Pose& p) { return Pose{p.place, p.course + pi}; };
    EXPECT_NEAR(shortest_way(end_of(mirrored(a)), end_of(mirrored(b)), 1)->length_m, length, 1e-7);
    EXPECT_NEAR(shortest_way(end_of(back(b)), end_of(back(a)), 1)->length_m, length, 1e-7) << "flown backwards";
    EXPECT_NEAR(shortest_way(WayEnd::pose(50 * a.place, a.course), WayEnd::pose(50 * b.place, b.course), 50)->length_m,
                50 * length, 1e-5);
  }
}

TEST(Dubins, KnownCases) {
  const auto way = [](const Pose& a, const Pose& b) { return shortest_way(end_of(a), end_of(b), 1).value(); };
  const Pose origin{{0, 0}, 0};
  EXPECT_NEAR(way(origin, {{10, 0}, 0}).length_m, 10, 1e-12) << "straight on";
  EXPECT_EQ(way(origin, {{10, 0}, 0}).pieces.size(), 1u);
  EXPECT_EQ(way(origin, origin).pieces.size(), 0u);
  EXPECT_EQ(way(origin, origin).length_m, 0);
  EXPECT_NEAR(way(origin, {{0, 2}, pi}).length_m, pi, 1e-9) << "half a circle to the right";
  EXPECT_NEAR(way(origin, {{1, 1}, pi / 2}).length_m, pi / 2, 1e-9);
  EXPECT_NEAR(way(origin, {{0, 10}, pi}).length_m, pi + 8, 1e-9);
  EXPECT_EQ(way(origin, {{0, 10}, pi}).word, "RSR");
  // To a place abreast at the same course: two quarters and a straight
  EXPECT_NEAR(way(origin, {{2, 10}, 0}).length_m, pi + 8, 1e-9);
  EXPECT_EQ(way(origin, {{2, 10}, 0}).word, "RSL");
  // Turn around on the spot: the three circles touch each other in an equilateral triangle: 60, 300, 60 degrees
  EXPECT_NEAR(way(origin, {{0, 0}, pi}).length_m, 7 * pi / 3, 1e-9);
  EXPECT_EQ(way(origin, {{0, 0}, pi}).word, "RLR") << "of two equally long ones the first";
  // Straight behind: equal ways to both sides, and rounding does not choose
  for (const double north : {-20.0, -20.3, -1e4}) EXPECT_EQ(way(origin, {{north, 0}, 0}).word, "RSR");
}

TEST(Dubins, OtherEndsTouchTheirCirclesAndPoints) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> radius(0.3, 3);
  int none = 0, some = 0;
  for (int i = 0; i < 4000; ++i) {
    const Pose from = random_pose(random, 6), to = random_pose(random, 6);
    // From a pose to a point: never longer than to any pose there
    const Way to_point = shortest_way(end_of(from), WayEnd::point(to.place), 1).value();
    EXPECT_NEAR((flown(from, to_point).place - to.place).norm(), 0, 1e-6);
    EXPECT_LE(to_point.length_m, shortest_way(end_of(from), end_of(to), 1)->length_m + 1e-9);
    // From a point to a circle, either way round
    const double r = radius(random);
    const bool clockwise = i % 2;
    const auto tangent = shortest_way(WayEnd::point(from.place), WayEnd::circle(to.place, r, clockwise), 1);
    const double distance = (to.place - from.place).norm();
    EXPECT_EQ(tangent.has_value(), distance >= r);
    none += !tangent, some += tangent.has_value();
    if (!tangent) continue;
    EXPECT_NEAR(tangent->length_m, std::sqrt(distance * distance - r * r), 1e-6);
    const double c = tangent->arrival_course_rad;
    const Vector2d touch = from.place + tangent->length_m * Vector2d(std::cos(c), std::sin(c));
    const Vector2d right(-std::sin(c), std::cos(c));
    EXPECT_NEAR((touch + (clockwise ? r : -r) * right - to.place).norm(), 0, 1e-6) << "the centre abreast, on its side";
  }
  EXPECT_GT(none, 50);
  EXPECT_GT(some, 1000);
  EXPECT_FALSE(shortest_way(WayEnd::circle({0, 0}, 5, true), WayEnd::circle({1, 0}, 2, true), 1)) << "one in the other";
  EXPECT_TRUE(shortest_way(WayEnd::circle({0, 0}, 5, true), WayEnd::circle({8, 0}, 2, false), 1));
}

}  // namespace
}  // namespace nadir::sim

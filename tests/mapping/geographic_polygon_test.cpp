#include "nadir/render/geographic_polygon.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "nadir/geodesy/geodetic.h"
#include "ogr_area.h"

namespace nadir::render {
namespace {

/// Polygons of one counter-clockwise ring of longitudes and latitudes in degrees, or of several.
std::vector<GeographicPolygon> polygons_of(const std::vector<std::vector<Eigen::Vector2d>>& rings) {
  std::vector<Outline> outlines;
  for (const auto& ring : rings) {
    Outline outline;
    for (auto p = ring.rbegin(); p != ring.rend(); ++p)
      outline.emplace_back(geodesy::to_radians(p->x()), geodesy::to_radians(p->y()));
    outlines.push_back(outline);
  }
  const auto polygons = geographic_polygons(outlines);
  EXPECT_EQ(test::complaint(polygons), "");
  return polygons;
}

/// In square degrees.
double area(const std::vector<GeographicPolygon>& polygons) { return test::ogr_area(polygons).get_Area(); }

TEST(GeographicPolygon, AnOrdinaryRingIsClosedAndTurnsCounterClockwise) {
  const auto polygons = polygons_of({{{1, 2}, {3, 2}, {3, 4}, {1, 4}}});
  ASSERT_EQ(polygons.size(), 1u);
  ASSERT_EQ(polygons[0].size(), 1u);
  EXPECT_EQ(polygons[0][0].size(), 5u);
  EXPECT_DOUBLE_EQ(area(polygons), 4);
}

TEST(GeographicPolygon, PositionsAreWrittenToABillionthOfADegree) {
  const auto polygons = polygons_of({{{5, 5}, {1, 4}, {1.00000000049, 2}, {3, 2.12345678951}}});
  const auto& ring = polygons[0][0];
  EXPECT_EQ(std::count(ring.begin(), ring.end(), Eigen::Vector2d(1, 2)), 1);
  EXPECT_EQ(std::count(ring.begin(), ring.end(), Eigen::Vector2d(3, 2.12345679)), 1);
}

TEST(GeographicPolygon, IsCutAtTheAntimeridian) {
  const auto polygons = polygons_of({{{179, 2}, {-178, 2}, {-178, 4}, {179, 4}}});
  ASSERT_EQ(polygons.size(), 2u);
  EXPECT_DOUBLE_EQ(area(polygons), 6);
  OGREnvelope box[2];
  for (int i = 0; i < 2; ++i) test::ogr_area({polygons[static_cast<std::size_t>(i)]}).getEnvelope(&box[i]);
  EXPECT_EQ(std::max(box[0].MaxX, box[1].MaxX), 180);
  EXPECT_EQ(std::min(box[0].MinX, box[1].MinX), -180);
}

TEST(GeographicPolygon, ARingThatGoesToAndFroAcrossTheAntimeridianHasManyParts) {
  // A comb whose teeth reach west across it
  const auto polygons = polygons_of({{{-179, 0},
                                      {-179, 6},
                                      {179, 6},
                                      {179, 5},
                                      {-179.5, 5},
                                      {-179.5, 4},
                                      {179, 4},
                                      {179, 3},
                                      {-179.5, 3},
                                      {-179.5, 2},
                                      {179, 2},
                                      {179, 1},
                                      {-179.5, 1},
                                      {-179.5, 0}}});
  EXPECT_EQ(polygons.size(), 4u);
  EXPECT_DOUBLE_EQ(area(polygons), 3 * 1.5 + 0.5 * 6);
}

TEST(GeographicPolygon, ARingMayTouchTheAntimeridian) {
  for (const double side : {1.0, -1.0}) {  // from the west, and from the east
    const auto on_side = [&](std::vector<Eigen::Vector2d> ring) {
      for (auto& p : ring) p.x() *= side;
      if (side < 0) std::reverse(ring.begin(), ring.end());
      return polygons_of({ring});
    };
    const auto corner = on_side({{179, 0}, {180, 1}, {179, 2}, {178, 1}});
    EXPECT_EQ(corner.size(), 1u);
    EXPECT_NEAR(area(corner), 2, 1e-9);
    const auto edge = on_side({{179, 0}, {180, 0}, {180, 1}, {180, 2}, {179, 2}});
    EXPECT_EQ(edge.size(), 1u);
    EXPECT_NEAR(area(edge), 2, 1e-9);
    // With a corner or an edge of what it leaves out, so that the part on that side falls in two
    const auto notch = on_side({{179, 0}, {-179, 0}, {-179, 2}, {179, 2}, {179, 1.5}, {180, 1}, {179, 0.5}});
    EXPECT_EQ(notch.size(), 3u);
    EXPECT_NEAR(area(notch), 4 - 0.5, 1e-9);
    const auto gap =
        on_side({{179, 0}, {-179, 0}, {-179, 2}, {179, 2}, {179, 1.5}, {180, 1.2}, {180, 0.8}, {179, 0.5}});
    EXPECT_EQ(gap.size(), 3u);
    EXPECT_NEAR(area(gap), 4 - 0.7, 1e-9);
  }
}

TEST(GeographicPolygon, ARingThatComesBackToAPlaceFallsIntoParts) {
  const auto two = polygons_of({{{0, 0}, {1, 1}, {2, 2}, {1, 3}, {1, 1}, {0, 1}}});
  EXPECT_EQ(two.size(), 2u);
  const auto hole = polygons_of({{{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 2}, {2, 1}}});
  ASSERT_EQ(hole.size(), 1u);
  EXPECT_EQ(hole[0].size(), 2u);
}

TEST(GeographicPolygon, AroundAPoleItReachesTheMapsEdge) {
  for (const double sign : {1.0, -1.0}) {
    std::vector<Eigen::Vector2d> ring;
    for (int lon = -170; lon < 190; lon += 20) ring.emplace_back(lon, sign * 80);
    if (sign < 0) std::reverse(ring.begin(), ring.end());
    const auto polygons = polygons_of({ring});
    ASSERT_EQ(polygons.size(), 1u);
    EXPECT_DOUBLE_EQ(area(polygons), 360 * 10);
    for (const Eigen::Vector2d& corner : {Eigen::Vector2d(180, sign * 90), Eigen::Vector2d(-180, sign * 90)})
      EXPECT_NE(std::find(polygons[0][0].begin(), polygons[0][0].end(), corner), polygons[0][0].end());
    // The same with a corner on the antimeridian
    std::vector<Eigen::Vector2d> turned;
    for (int lon = -180; lon < 180; lon += 20) turned.emplace_back(lon, sign * 80);
    if (sign < 0) std::reverse(turned.begin(), turned.end());
    EXPECT_DOUBLE_EQ(area(polygons_of({turned})), 360 * 10);
  }
}

TEST(GeographicPolygon, ACornerAtAPoleIsALineOnTheMap) {
  // A third of a turn and two thirds, clear of the antimeridian and across it
  EXPECT_DOUBLE_EQ(area(polygons_of({{{0, 80}, {60, 80}, {120, 80}, {77, 90}}})), 1200);
  EXPECT_DOUBLE_EQ(area(polygons_of({{{0, -80}, {-180, -90}, {120, -80}, {60, -80}}})), 1200);
  EXPECT_DOUBLE_EQ(area(polygons_of({{{0, 80}, {80, 80}, {160, 80}, {-120, 80}, {0, 90}}})), 2400);
  EXPECT_DOUBLE_EQ(area(polygons_of({{{120, 80}, {180, 80}, {-120, 80}, {0, 90}}})), 1200);
  EXPECT_DOUBLE_EQ(area(polygons_of({{{-180, 80}, {-90, 80}, {0, 90}}})), 900) << "a side runs along the antimeridian";
  EXPECT_DOUBLE_EQ(area(polygons_of({{{90, 80}, {180, 80}, {0, 90}}})), 900);
}

TEST(GeographicPolygon, ALineMayPassAPole) {
  // Half the cap north of 80 degrees, on either side of the diameter from 30 to -150 and from 0 to 180
  EXPECT_DOUBLE_EQ(area(polygons_of({{{30, 80}, {90, 80}, {150, 80}, {-150, 80}}})), 1800);
  EXPECT_DOUBLE_EQ(area(polygons_of({{{-150, 80}, {-90, 80}, {-30, 80}, {30, 80}}})), 1800);
  EXPECT_DOUBLE_EQ(area(polygons_of({{{0, 80}, {60, 80}, {120, 80}, {180, 80}}})), 1800);
  EXPECT_DOUBLE_EQ(area(polygons_of({{{180, -80}, {120, -80}, {60, -80}, {0, -80}}})), 1800);
}

TEST(GeographicPolygon, HolesTurnClockwiseAndAreCutToo) {
  const auto hole = polygons_of({{{0, 0}, {9, 0}, {9, 9}, {0, 9}}, {{3, 3}, {3, 6}, {6, 6}, {6, 3}}});
  ASSERT_EQ(hole.size(), 1u);
  EXPECT_EQ(hole[0].size(), 2u);
  EXPECT_DOUBLE_EQ(area(hole), 72);
  const auto cut =
      polygons_of({{{176, 0}, {-175, 0}, {-175, 9}, {176, 9}}, {{179, 3}, {179, 6}, {-178, 6}, {-178, 3}}});
  EXPECT_EQ(cut.size(), 2u);
  EXPECT_DOUBLE_EQ(area(cut), 72);
  std::vector<std::vector<Eigen::Vector2d>> cap(2);
  for (int lon = -170; lon < 190; lon += 20) {
    cap[0].emplace_back(lon, 70);
    cap[1].emplace_back(-lon, 80);
  }
  EXPECT_DOUBLE_EQ(area(polygons_of(cap)), 3600) << "the hole is around a pole";
}

TEST(GeographicPolygon, WhatHasNoAreaIsNone) {
  EXPECT_TRUE(polygons_of({}).empty());
  EXPECT_TRUE(polygons_of({{}}).empty());
  EXPECT_TRUE(polygons_of({{{5, 5}}}).empty());
  EXPECT_TRUE(polygons_of({{{5, 5}, {6, 6}}}).empty());
  EXPECT_TRUE(polygons_of({{{5, 5}, {5, 5}, {5, 5 + 1e-10}}}).empty());
  EXPECT_TRUE(polygons_of({{{0, 90}, {90, 90}, {180, 90}}}).empty());
  EXPECT_TRUE(polygons_of({{{180, 1}, {180, 2}, {-180, 3}}}).empty());
}

}  // namespace
}  // namespace nadir::render

#include "nadir/render/footprint.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nadir::render {
namespace {

using geodesy::Geodetic, geodesy::YawPitchRoll;

Footprint footprint_of(double height_m, const YawPitchRoll& attitude) {
  const Geodetic origin = Geodetic::degrees(38.1, -0.76, 0);
  Geodetic place = origin;
  place.height_m = height_m;
  const ExactChain chain(Camera::pinhole(640, 480, 500, 500, 320, 240).value(), camera_pose(place, attitude),
                         Plane(origin, 0));
  return footprint(chain, geodesy::Projection::from_definition("EPSG:4326").value());
}

TEST(Footprint, ALevelViewCoversWhatSimilarTrianglesSay) {
  const Footprint f = footprint_of(1000, {});
  // Half the image over the focal length, times the height: 640 m east, 480 m north.
  ASSERT_TRUE(f.corners[0] && f.corners[2]);
  EXPECT_NEAR((f.corners[0]->enu_m - Eigen::Vector3d(-640, 480, 0)).norm(), 0, 1e-6) << "top left is north-west";
  EXPECT_NEAR((f.corners[2]->enu_m - Eigen::Vector3d(640, -480, 0)).norm(), 0, 1e-6);
  EXPECT_LT(f.corners[0]->lon_lat_rad.x(), f.corners[1]->lon_lat_rad.x());
  EXPECT_GT(f.corners[0]->lon_lat_rad.y(), f.corners[3]->lon_lat_rad.y());
  EXPECT_EQ(f.outline_lon_lat_rad.size(), 64u);
}

TEST(Footprint, ACornerInTheSkyHasNoPointAndTheOutlineEndsAtTheHorizon) {
  const Footprint f =
      footprint_of(1000, YawPitchRoll::degrees(0, 75, 0));  // the top of the image sees 100 degrees from down
  EXPECT_FALSE(f.corners[0]);
  EXPECT_FALSE(f.corners[1]);
  EXPECT_TRUE(f.corners[2]);
  EXPECT_FALSE(f.outline_lon_lat_rad.empty());
  for (const auto& p : f.outline_lon_lat_rad) EXPECT_TRUE(p.allFinite());
}

TEST(Footprint, TheSkyAloneHasNone) {
  const Footprint f = footprint_of(1000, YawPitchRoll::degrees(0, 180, 0));
  EXPECT_TRUE(f.outline_lon_lat_rad.empty());
  for (const auto& corner : f.corners) EXPECT_FALSE(corner);
}

}  // namespace
}  // namespace nadir::render

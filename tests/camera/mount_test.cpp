#include "nadir/render/mount.h"

#include <gtest/gtest.h>

namespace nadir::render {
namespace {
using namespace geodesy;

TEST(Mount, ByDefaultTheImagesTopIsTheNoseAndItsRightTheRightWing) {
  Eigen::Matrix3d expected;
  expected << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  EXPECT_NEAR((body_from_camera({}).rotation.toRotationMatrix() - expected).norm(), 0, 1e-15);
}

TEST(Mount, AVehicleFlyingEastHasNorthAtTheImagesLeft) {
  const auto place = Geodetic::degrees(38.1, -0.76, 3000);
  const CameraPose pose = look_down(place, Degrees{90});
  const LocalFrame local(place);
  const auto enu = [&](const Eigen::Vector3d& camera) {
    return (local.enu_from_ecef() * (pose * Direction<frame::Camera>{camera})).xyz;
  };
  EXPECT_NEAR((enu({0, -1, 0}) - Eigen::Vector3d(1, 0, 0)).norm(), 0, 1e-14) << "top of the image: ahead, east";
  EXPECT_NEAR((enu({-1, 0, 0}) - Eigen::Vector3d(0, 1, 0)).norm(), 0, 1e-14) << "left of the image: north";
  EXPECT_NEAR((enu({0, 0, 1}) - Eigen::Vector3d(0, 0, -1)).norm(), 0, 1e-14) << "the optical axis: down";
}

TEST(Mount, PitchingTheMountUpLooksAhead) {
  Mount mount;
  mount.angles = YawPitchRoll::degrees(0, 30, 0);
  mount.position_m = {1, 2, 3};
  const auto place = Geodetic::degrees(10, 20, 1000);
  const CameraPose pose = camera_pose(place, YawPitchRoll::degrees(0, 0, 0), mount);  // flying north
  const LocalFrame local(place);
  const Eigen::Vector3d axis = (local.enu_from_ecef() * (pose * Direction<frame::Camera>{{0, 0, 1}})).xyz;
  EXPECT_NEAR((axis - Eigen::Vector3d(0, 0.5, -std::sqrt(0.75))).norm(), 0, 1e-14);
  const Eigen::Vector3d at = (local.enu_from_ecef() * Point<frame::Ecef>{pose.origin}).xyz;
  EXPECT_NEAR((at - Eigen::Vector3d(2, 1, -3)).norm(), 0, 1e-8) << "forward is north, right is east, down is down";
}

}  // namespace
}  // namespace nadir::render

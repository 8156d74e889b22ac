#include "nadir/sim/pose_file.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace nadir::sim {
namespace {

using geodesy::Geodetic;

class PoseFile : public testing::Test {
 protected:
  Result<std::vector<TimedPose>> read(const std::string& text, const render::Mount& mount = {}) {
    return read_pose_file(folder.write("poses.csv", text), ground, mount);
  }
  std::string message(const std::string& text) {
    const auto poses = read(text);
    return poses ? "accepted" : poses.error().message;
  }
  test::TemporaryFolder folder;
  render::Plane ground{Geodetic::degrees(38.1, -0.76, 0), 100};
  const std::string header = "t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg\n";
};

TEST_F(PoseFile, AVehiclesPosesCarryTheCameraOnItsMount) {
  render::Mount mount;
  mount.angles = geodesy::YawPitchRoll::degrees(0, 20, 0);
  const auto poses =
      read("# a flight\n" + header + "0, 38.1, -0.76, 3000, 90, 1, 2\r\n\n0.1,38.1,-0.75,2900 agl,91,0,0\n", mount)
          .value();
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[1].time_ns, 100'000'000);
  const auto expected =
      render::camera_pose(Geodetic::degrees(38.1, -0.76, 3000), geodesy::YawPitchRoll::degrees(90, 1, 2), mount);
  EXPECT_EQ(poses[0].ecef_from_camera.origin, expected.origin);
  EXPECT_TRUE(poses[0].ecef_from_camera.rotation.isApprox(expected.rotation, 1e-15));
  EXPECT_NEAR(geodesy::geodetic_from_ecef({poses[1].ecef_from_camera.origin}).height_m, 3000, 1e-6)
      << "2900 m above a ground at 100 m";
}

TEST_F(PoseFile, ColumnsMayComeInAnyOrder) {
  const auto poses = read("lon_deg,lat_deg,t_s,height_m,roll_deg,pitch_deg,yaw_deg\n-0.76,38.1,5,3000,0,0,0\n").value();
  EXPECT_EQ(poses[0].time_ns, 5'000'000'000);
  EXPECT_NEAR(geodesy::to_degrees(geodesy::geodetic_from_ecef({poses[0].ecef_from_camera.origin}).lat_rad), 38.1,
              1e-12);
}

TEST_F(PoseFile, ACamerasPosesStandAtTheSceneOrigin) {
  const auto poses =
      read("t_s,x_m,y_m,z_m,qx,qy,qz,qw\n0,10,20,500,1,0,0,0\n").value();  // half a turn about east: looking down
  const auto enu_from_camera = ground.frame().enu_from_ecef() * poses[0].ecef_from_camera;
  EXPECT_NEAR((enu_from_camera.origin - Eigen::Vector3d(10, 20, 500)).norm(), 0, 1e-8);
  EXPECT_NEAR((enu_from_camera.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d(0, 0, -1)).norm(), 0, 1e-14);
}

TEST_F(PoseFile, FaultsNameLineAndColumn) {
  EXPECT_NE(message("t_s,lat_deg,lon_deg,hieght_m,yaw_deg,pitch_deg,roll_deg\n")
                .find("poses.csv:1: unknown column 'hieght_m'; did you mean 'height_m'?"),
            std::string::npos);
  EXPECT_NE(message("t_s,lat_deg\n").find("the column 'lon_deg' is missing"), std::string::npos);
  EXPECT_NE(message(header + "0,38,x,1,0,0,0\n").find("poses.csv:2: lon_deg: expected a number, found 'x'"),
            std::string::npos);
  EXPECT_NE(message(header + "0,91,0,1,0,0,0\n").find("lat_deg: expected a value from -90 to 90"), std::string::npos);
  EXPECT_NE(message(header + "0,38,0,1,0,0\n").find("expected 7 fields, found 6"), std::string::npos);
  EXPECT_NE(message(header + "1,38,0,1,0,0,0\n1,38,0,1,0,0,0\n").find("poses.csv:3: t_s: expected times to rise"),
            std::string::npos);
  EXPECT_NE(message(header + "0,38,0,12 msk,0,0,0\n").find("unknown datum 'msk'"), std::string::npos);
  EXPECT_NE(message(header).find("expected poses, found none"), std::string::npos);
  EXPECT_NE(message("t_s,x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0,1,1,1,0,0\n").find("unit quaternion"), std::string::npos);
  EXPECT_NE(message(header + "0,nan,0,1,0,0,0\n").find("lat_deg"), std::string::npos);
}

}  // namespace
}  // namespace nadir::sim

#include "nadir/render/mount.h"

namespace nadir::render {
using namespace geodesy;

Rotation<frame::Mount, frame::Camera> mount_from_camera() {
  const double half = std::sqrt(0.5);
  return {Eigen::Quaterniond(half, 0, 0, half)};  // a quarter turn about down: [[0,-1,0],[1,0,0],[0,0,1]]
}

Pose<frame::Body, frame::Camera> body_from_camera(const Mount& mount) {
  const Pose<frame::Body, frame::Mount> body_from_mount{quaternion_from(mount.angles), mount.position_m};
  return body_from_mount * Pose<frame::Mount, frame::Camera>{mount_from_camera().quaternion, Eigen::Vector3d::Zero()};
}

CameraPose camera_pose(const Geodetic& place, const YawPitchRoll& attitude, const Mount& mount) {
  const Pose<frame::Ned, frame::Body> ned_from_body_pose{quaternion_from(attitude), Eigen::Vector3d::Zero()};
  return ecef_from_ned(place) * ned_from_body_pose * body_from_camera(mount);
}

CameraPose look_down(const Geodetic& place, Degrees yaw) { return camera_pose(place, {yaw.radians(), 0, 0}); }

}  // namespace nadir::render

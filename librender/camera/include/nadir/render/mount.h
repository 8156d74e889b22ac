#pragma once

#include "nadir/geodesy/attitude.h"
#include "nadir/geodesy/frames.h"
#include "nadir/geodesy/geodetic.h"

namespace nadir::render {

using CameraPose = geodesy::Pose<geodesy::frame::Ecef, geodesy::frame::Camera>;  // ecef_from_camera

/// How a camera sits on its vehicle. By default it is at the vehicle's origin and looks straight down with the image's
/// top towards the nose; `position_m` and `angles` move and turn it from there, in body axes.
struct Mount {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  // forward, right, down
  geodesy::YawPitchRoll angles;                          // of the mount in the body
};

/// Camera axes in mount axes: image right is right, image down is backward, the optical axis is down.
geodesy::Rotation<geodesy::frame::Mount, geodesy::frame::Camera> mount_from_camera();

geodesy::Pose<geodesy::frame::Body, geodesy::frame::Camera> body_from_camera(const Mount& mount);

/// Pose of a camera on a vehicle at `place`, whose attitude counts from north-east-down there.
CameraPose camera_pose(const geodesy::Geodetic& place, const geodesy::YawPitchRoll& attitude, const Mount& mount = {});

/// A camera at `place` looking straight down, image top towards `yaw` (clockwise from north).
CameraPose look_down(const geodesy::Geodetic& place, geodesy::Degrees yaw);

}  // namespace nadir::render

#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/render/mount.h"
#include "nadir/render/surface.h"

namespace nadir::sim {

/// Where a camera is at one time.
struct TimedPose {
  std::int64_t time_ns = 0;  // since the start of the run
  render::CameraPose ecef_from_camera;
};

/// Reads a pose file: CSV with a header, '#' comments and empty lines skipped, times rising. Its columns, in any order:
///  - `t_s,lat_deg,lon_deg,height_m,yaw_deg,pitch_deg,roll_deg`: the vehicle's pose, on which the camera sits by
///  `mount`.
///    A height may carry a datum: `120 agl`, `85.2 msl`.
///  - `t_s,x_m,y_m,z_m,qx,qy,qz,qw`: enu_from_camera at the scene origin; unit quaternions (Hamilton) to within 1e-3,
///  made
///    exact. `mount` does not apply.
/// A fault is reported with its line.
Result<std::vector<TimedPose>> read_pose_file(const std::filesystem::path& path, const render::Surface& ground,
                                              const render::Mount& mount);

}  // namespace nadir::sim

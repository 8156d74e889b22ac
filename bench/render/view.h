#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::bench {

/// One camera over one map, as Nadir takes it and as everyone else does.
struct View {
  std::string name;  // without blanks
  int width = 0, height = 0;
  double focal_px = 0;
  std::array<double, 9> enu_from_camera{};  // rotation, row by row
  std::array<double, 3> camera_enu_m{};     // at the map's centre
  /// Row by row; both put the centre of the first pixel at (0, 0).
  std::array<double, 9> map_pixel_from_image_pixel{};
  double homography_error_px = 0;  // its greatest distance from the exact chain

  friend bool operator==(const View&, const View&) = default;
};

/// A place in pixels whose first has its centre at (0, 0), and how it moves a pixel to the right and down.
struct MapPoint {
  double x = 0, y = 0;
  double dx_du = 0, dx_dv = 0, dy_du = 0, dy_dv = 0;
};

/// What a place in the image shows.
MapPoint map_point(const std::array<double, 9>& map_from_image, double u, double v);

/// Views as a file, for programs that are started to render them: a line each, numbers that read back as the same bits.
Result<void> write_views(const std::filesystem::path& path, const std::vector<View>& views);
Result<std::vector<View>> read_views(const std::filesystem::path& path);

}  // namespace nadir::bench

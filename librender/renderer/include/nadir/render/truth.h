#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "nadir/geodesy/attitude.h"
#include "nadir/render/exact_chain.h"
#include "nadir/render/footprint.h"
#include "nadir/render/quality.h"
#include "nadir/tile/map.h"

namespace nadir::render {

/// How a frame was exposed, where that took time.
struct Exposure {
  Shutter shutter;
  double motion_px = 0;  // greatest way in the image that what is seen goes while a row is exposed
  int poses = 1;         // that stand for each row's exposure
  // When the exposure of the image's upper edge begins, and when that of its lower edge ends
  CameraPose ecef_from_camera_at_start, ecef_from_camera_at_end;
};

/// What of a frame was sampled from coarser levels than planned: see RenderOptions::allow_coarse.
struct CoarseFill {
  double fraction = 0;  // of the image's pixels, in blocks
  int levels = 0;       // at most, from the finest level planned for a block to the finest sampled
};

/// What is known exactly about one layer of one frame. Matrices and pixel positions are for coordinates that put the
/// centre of the first pixel at (0, 0), as OpenCV and ROS do; texel and uv footprints count from the map's outer
/// corner.
struct Truth {
  CameraPose ecef_from_camera;
  geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera> enu_from_camera;  // at the scene origin
  geodesy::Geodetic position;                                                  // of the camera
  geodesy::YawPitchRoll attitude;  // of the vehicle that would carry the camera in the default mount, at its position
  double height_agl_m = 0;         // above the surface

  /// Empty where the shutter is instant. All else here is then of the middle of each row's exposure; poses of the
  /// image's middle row.
  std::optional<Exposure> exposure;

  int width = 0, height = 0;
  Eigen::Matrix3d camera_matrix = Eigen::Matrix3d::Identity();
  Lens lens;

  std::string map_path, map_crs, map_acquired;
  double map_gsd_m = 0;  // side of a texel, true metres at the map's centre

  /// Through the four outer corners of the image. Empty where one sees no ground, or the map's CRS is not defined
  /// there, and where the surface is no plane. Across the two ends of a map that goes around the Earth, columns are
  /// counted on from the first corner's.
  std::optional<Eigen::Matrix3d> map_pixel_from_image_pixel, image_pixel_from_map_pixel;
  std::optional<double>
      homography_max_error_px;  // greatest distance, in image pixels, from the exact chain on a 9x9 grid

  Footprint footprint;
  std::array<std::optional<Eigen::Vector2d>, 4> footprint_texel, footprint_uv;

  double valid_fraction = 0;
  std::vector<std::string> damage;    // tiles that cannot be decoded, with file and cause: invalid where they are seen
  std::optional<double> image_gsd_m;  // at the image's middle, on the surface; empty where that sees no ground
  std::optional<double> magnification;  // map texels over image pixels, as lengths on the ground

  Quality quality = Quality::balanced;
  Filter filter = Filter::Mip;
  double oversampling = 1;  // of Mip and Reference: see Sampling
  bool adaptive = false;    // chosen from how long earlier frames took: see AdaptiveQuality
  int finest_level = 0, coarsest_level = 0;
  std::int64_t tiles = 0;            // cells sampled from
  std::optional<CoarseFill> coarse;  // where that was allowed; of the instants of an exposure, the greatest
  bool undersampled = false;         // the map has too few levels for this view
  double geometry_error_px = 0;      // greatest found where the mapping was checked
  /// Root mean square against the reference filter, in the frame's values, as the plan expects it. Empty where the map
  /// does not tell what its levels lose (nadir build stores it), of decibels and of labels.
  std::optional<double> expected_rmse;
  double render_ms = 0;  // of the whole frame, all layers
};

/// All of it that depends on geometry alone.
Truth geometric_truth(const ExactChain& chain, const tile::Map& map);

}  // namespace nadir::render

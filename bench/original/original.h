#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "nadir/render/camera.h"
#include "nadir/tile/map.h"

namespace nadir::bench {

using EnuFromCamera = geodesy::Pose<geodesy::frame::Enu, geodesy::frame::Camera>;

/// What the sensor's corners see, in the original's order: top left, top right, bottom left, bottom right.
struct OriginalFootprint {
  std::array<Eigen::Vector2d, 4> world_m;       // on the plane, X east and Y north from the map's middle
  std::array<Eigen::Vector2d, 4> reference_px;  // u * columns, v * rows
};

/// The renderer of the 2022 plugin, written anew from its published formulas: a textured plane, four corner rays, one
/// perspective warp of the whole 8-bit reference. One thing is not re-enacted: its rectangle is two triangles, and a
/// corner exactly on their diagonal is taken for a miss.
class Original {
 public:
  /// `reference`: BGR, 8 bits. `plane_m`: size of the plane that it covers.
  Original(cv::Mat reference, const Eigen::Vector2d& plane_m) : reference_(std::move(reference)), plane_m_(plane_m) {}

  /// Empty where a corner misses the plane: the original then publishes nothing.
  std::optional<OriginalFootprint> footprint(const render::Camera& camera, const EnuFromCamera& enu_from_camera) const;

  /// Reference pixels to sensor pixels, through single-precision corners. `sensor_px`: where the outer corners come to
  /// lie; the original takes the rectangle of the pixel centres, 0 to W - 1, for them.
  static cv::Mat sensor_from_reference(const std::array<Eigen::Vector2d, 4>& reference_px, const cv::Rect2f& sensor_px);
  static cv::Rect2f its_rectangle(const render::Camera& camera);

  /// The simulated image: bilinear, black where the reference ends.
  cv::Mat picture(const cv::Mat& sensor_from_reference, const render::Camera& camera) const;

  /// What it publishes beside each image: a copy of the whole reference with the footprint filled in.
  cv::Mat truth_picture(const OriginalFootprint& footprint) const;

  const Eigen::Vector2d& plane_m() const { return plane_m_; }

 private:
  cv::Mat reference_;
  Eigen::Vector2d plane_m_;
};

/// Level, image top to the north, east and north of the middle and above the plane in metres: where both methods fly.
EnuFromCamera level(double east_m, double north_m, double height_m);

/// The first three bands (red, green, blue) of a map of bytes as the original holds them, read without a second copy.
cv::Mat read_bgr(const tile::Map& map);

/// The plane as the original sizes it: map coordinates taken for metres, whatever the latitude.
Eigen::Vector2d plane_of_map_units(const tile::Map& map);

/// The plane in true metres, so that both methods see the same ground.
Eigen::Vector2d plane_of_true_metres(const tile::Map& map);

}  // namespace nadir::bench

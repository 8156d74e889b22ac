#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "nadir/base/result.h"

namespace nadir::render {

/// An ideal pinhole camera: image size and intrinsics.
///
/// Image coordinates put the centre of the first pixel at (0.5, 0.5): the image spans [0, width] x [0, height]. Camera
/// files, as ROS camera calibration writes them, put it at (0, 0): their principal point gains 0.5 when it comes in
/// here and loses it when it goes out, and is never adjusted in between. Invariant: sizes within [1, 65536], focal
/// lengths positive, all finite.
class Camera {
 public:
  /// Focal lengths and principal point in pixels, the latter in image coordinates (the middle of the image is width /
  /// 2).
  static Result<Camera> pinhole(int width_px, int height_px, double fx_px, double fy_px, double cx_px, double cy_px);

  /// Reads a ROS camera calibration. Every key is checked. A lens with distortion is refused: none is modelled.
  static Result<Camera> from_yaml(const std::filesystem::path& path);
  /// The ROS camera calibration of this camera, every digit kept.
  std::string to_yaml() const;

  const std::string& name() const { return name_; }
  void set_name(std::string name) { name_ = std::move(name); }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  double fx_px() const { return focal_px_.x(); }
  double fy_px() const { return focal_px_.y(); }
  Eigen::Vector2d principal_point_px() const { return principal_point_px_; }

  /// Direction (x, y, 1) in camera axes of the ray through an image point (u, v, 1).
  Eigen::Matrix3d ray_from_image() const;
  /// The camera matrix K as OpenCV and ROS have it: pixel centres at integers.
  Eigen::Matrix3d ros_camera_matrix() const;

 private:
  Camera() = default;
  std::string name_ = "camera";
  int width_px_ = 1, height_px_ = 1;
  Eigen::Vector2d focal_px_, principal_point_px_;
};

}  // namespace nadir::render

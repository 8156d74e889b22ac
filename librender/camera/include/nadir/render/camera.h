#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "nadir/base/result.h"
#include "nadir/render/lens.h"

namespace nadir::render {

/// A camera: image size, intrinsics and lens.
///
/// Image coordinates put the centre of the first pixel at (0.5, 0.5): the image spans [0, width] x [0, height]. Camera
/// files, as ROS camera calibration writes them, put it at (0, 0): their principal point gains 0.5 when it comes in
/// here and loses it when it goes out, and is never adjusted in between. Invariant: sizes within [1, 65536], focal
/// lengths within [1e-6, 1e12], principal point within 1e9, all in pixels.
class Camera {
 public:
  /// Focal lengths and principal point in pixels, the latter in image coordinates (the middle of the image is width /
  /// 2).
  static Result<Camera> pinhole(int width_px, int height_px, double fx_px, double fy_px, double cx_px, double cy_px);

  /// This camera with a lens before it.
  Camera with_lens(Lens lens) const;

  /// Reads a ROS camera calibration. Every key is checked.
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

  const Lens& lens() const { return lens_; }

  /// Unit direction in camera axes of the ray that an image point shows; empty where the lens shows none there.
  std::optional<Eigen::Vector3d> ray_of(const Eigen::Vector2d& image) const;
  /// Where a ray of any length appears, within the image or beside it; empty where the lens has no place for it.
  std::optional<Eigen::Vector2d> image_of(const Eigen::Vector3d& ray) const;

  /// Of an ideal lens: direction (x, y, 1) in camera axes of the ray through an image point (u, v, 1).
  Eigen::Matrix3d ray_from_image() const;
  /// The camera matrix K as OpenCV and ROS have it: pixel centres at integers.
  Eigen::Matrix3d ros_camera_matrix() const;

 private:
  Camera() = default;
  std::string name_ = "camera";
  int width_px_ = 1, height_px_ = 1;
  Eigen::Vector2d focal_px_, principal_point_px_;
  Lens lens_;
};

}  // namespace nadir::render

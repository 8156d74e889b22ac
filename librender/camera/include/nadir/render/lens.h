#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::render {

/// How OpenCV and ROS name what a lens does to directions.
enum class LensModel {
  plumb_bob,            // k1, k2, p1, p2, k3: Brown-Conrady, OpenCV's default
  rational_polynomial,  // k1, k2, p1, p2, k3, k4, k5, k6
  equidistant,          // k1, k2, k3, k4: OpenCV's fisheye (Kannala-Brandt)
};
std::string_view to_string(LensModel model);
Result<LensModel> parse_lens_model(std::string_view text);

/// From directions of rays, in camera axes, to the image plane at focal length 1, and back.
///
/// plumb_bob and rational_polynomial move the point (x, y) = (X, Y) / Z, r its distance from the axis:
///   x' = x f + 2 p1 x y + p2 (r^2 + 2 x^2),  y' = y f + p1 (r^2 + 2 y^2) + 2 p2 x y,
///   f = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6).
/// equidistant puts a ray at angle t from the axis at distance t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8).
/// Source: OpenCV, modules calib3d and fisheye.
///
/// Such polynomials fold: from some distance on, larger angles come back towards the middle. A lens is valid up to
/// where its radial part turns, and where its whole Jacobian has a positive determinant; beyond, no ray has an image
/// and no image point a ray.
/// Error of the inverse: below 1e-12 of the focal length, where the Jacobian's condition is below 1e3; magnified by it
/// towards the fold. A value.
class Lens {
 public:
  /// The ideal pinhole.
  Lens() = default;
  /// Malformed where there are too many coefficients (missing ones count as 0), or they are not finite; Unsupported
  /// for coefficients of a thin prism or a tilted sensor that are not 0.
  static Result<Lens> make(LensModel model, std::span<const double> coefficients);

  LensModel model() const { return model_; }
  const std::vector<double>& coefficients() const { return coefficients_; }
  /// Whether it leaves all points where an ideal pinhole has them.
  bool ideal() const { return ideal_; }

  /// Where its radial part turns: distance from the axis at depth 1 of rays, infinite where it never does; of
  /// equidistant lenses the angle from the axis, at most pi.
  double valid_radius() const { return valid_radius_; }

  /// The image of a ray of any length; empty beyond what is valid, and behind the camera but for equidistant lenses.
  std::optional<Eigen::Vector2d> image_of(const Eigen::Vector3d& ray) const;
  /// The unit ray of a point of the image plane; empty beyond what is valid.
  std::optional<Eigen::Vector3d> ray_of(const Eigen::Vector2d& image) const;

 private:
  struct Moved {
    Eigen::Vector2d point;
    Eigen::Matrix2d jacobian;
  };
  Moved move(const Eigen::Vector2d& p) const;
  double radial(double r) const;
  double radial_slope(double r) const;
  std::optional<double> inverse_radial(double distance) const;

  LensModel model_ = LensModel::plumb_bob;
  std::vector<double> coefficients_ = std::vector<double>(5, 0.0);
  bool ideal_ = true;
  double valid_radius_ = std::numeric_limits<double>::infinity();
  double greatest_image_radius_ = std::numeric_limits<double>::infinity();  // the radial part's at valid_radius_
};

}  // namespace nadir::render

#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>

namespace nadir::render {

/// `h` applied to a point of the plane. The third homogeneous coordinate must not vanish there.
inline Eigen::Vector2d apply(const Eigen::Matrix3d& h, const Eigen::Vector2d& p) {
  const Eigen::Vector3d q = h * p.homogeneous();
  return q.head<2>() / q.z();
}

/// Derivative of `apply` at a point: columns are the steps per unit of x and of y.
Eigen::Matrix2d jacobian(const Eigen::Matrix3d& h, const Eigen::Vector2d& p);

/// The homography that takes the corners (0,0), (w,0), (w,h), (0,h) of a rectangle to `corners`, scaled so that its
/// last element is 1. Empty where the corners are not a convex quadrangle of some area. Closed form. Source: Heckbert,
/// Fundamentals of Texture Mapping and Image Warping, 1989, section 2.2.3.
std::optional<Eigen::Matrix3d> homography_from_rectangle(double w, double h,
                                                         const std::array<Eigen::Vector2d, 4>& corners);

/// The same homography for coordinates that put the centre of the first pixel at (0, 0) on both sides, as OpenCV and
/// ROS do, from one for coordinates that put it at (0.5, 0.5): the one place where this border is crossed. Last
/// element 1.
Eigen::Matrix3d with_centres_at_integers(const Eigen::Matrix3d& a_from_b);

}  // namespace nadir::render

#pragma once

#include <Eigen/Core>
#include <optional>

#include "nadir/render/exact_chain.h"

namespace nadir::bench {

/// Where a place on the ground appears in the image, in 64 bits of mantissa and the other way round than the renderer
/// goes: longitude, latitude, surface, lens, image point. Shares no arithmetic with it: formulas of the geodetic
/// coordinates, of the tangent plane and of the lens models, written once more.
class ReferenceChain {
 public:
  using Real = long double;
  using Vector2 = Eigen::Matrix<Real, 2, 1>;
  using Vector3 = Eigen::Matrix<Real, 3, 1>;

  /// Of the same camera, pose and surface as a chain: its numbers count as exact.
  explicit ReferenceChain(const render::ExactChain& chain);

  /// The image point at which the surface's point over a place appears; empty behind the camera.
  std::optional<Vector2> image_of(const Eigen::Vector2d& lon_lat_rad) const;

  /// By how much a place that an image point is said to see appears elsewhere, in pixels; infinite where it does not.
  double error_px(const Eigen::Vector2d& image, const Eigen::Vector2d& lon_lat_rad) const;

  /// By how many radians the ray of an image point of an ideal lens sinks below the horizon of an unbounded surface;
  /// negative above it.
  Real sinks_by_rad(const Eigen::Vector2d& image) const;

 private:
  Vector3 ecef(const Eigen::Vector2d& lon_lat_rad, Real height_m) const;
  Vector3 ground(const Eigen::Vector2d& lon_lat_rad) const;
  std::optional<Vector2> through_lens(const Vector3& ray) const;

  const render::Camera camera_;
  const render::Surface surface_;
  Eigen::Matrix<Real, 3, 3> ecef_from_camera_;
  Vector3 position_, plane_point_, plane_normal_;
};

}  // namespace nadir::bench

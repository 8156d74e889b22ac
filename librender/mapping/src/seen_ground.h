#pragma once

#include <optional>
#include <vector>

#include "nadir/render/exact_chain.h"

namespace nadir::render {

/// A stretch of the border of what a frame sees.
struct Arc {
  enum class Kind {
    ImageLine,  // from one image point to another
    LensEdge,   // around what the lens shows, from one angle to another; angles are in x, clockwise on the image
    Horizon,    // likewise around the ground
  };
  Kind kind = Kind::ImageLine;
  Eigen::Vector2d from, to;

  Eigen::Vector2d at(double s) const { return from + s * (to - from); }
  Arc part(double s0, double s1) const { return {kind, at(s0), at(s1)}; }
};

/// Arcs of which each begins where the one before ends, and the first where the last one ends. What is seen lies to the
/// right, as seen from the camera.
using Loop = std::vector<Arc>;

/// Where a frame sees ground: the image, what the lens shows and the ground, each with a border of one piece, cut with
/// one another on the sphere of directions around the camera.
class SeenGround {
 public:
  /// `chain` is kept by reference.
  explicit SeenGround(const ExactChain& chain);

  /// The borders of what is seen; none where no ground is.
  std::vector<Loop> loops() const;

  /// Longitude and latitude of the place at s in [0, 1] of an arc; empty where rounding leaves none, next to the
  /// horizon.
  std::optional<Eigen::Vector2d> lon_lat(const Arc& arc, double s) const;

 private:
  struct Border;
  struct Crossing;
  Loop image_loop() const;
  Loop flat_loop() const;
  std::vector<Crossing> crossings(const Loop& loop, const Border& border) const;
  std::vector<Loop> cut(const Loop& loop, const Border& border, bool border_within) const;

  std::optional<Eigen::Vector3d> ray(const Arc& arc, double s) const;
  Eigen::Vector3d lens_edge(double angle) const;
  bool within_image(const Eigen::Vector3d& camera_ray) const;

  Eigen::Vector3d ground_direction(const Eigen::Vector3d& camera_ray) const;
  Eigen::Vector3d horizon(double angle) const;
  Eigen::Vector3d towards_horizon(double angle) const;
  std::optional<Eigen::Vector2d> lon_lat_of(const Eigen::Vector3d& camera_ray) const;

  const ExactChain& chain_;
  bool above_ground_ = false;
  // The horizon is a circle: of a plane in the scene's frame, of the ellipsoid in coordinates in which that is the unit
  // sphere. Seen from the camera, its directions lie at one angle from an axis.
  Eigen::Vector3d axis_, right_, down_;  // unit vectors; angles turn from right to down
  double cos_edge_ = 0;                  // of the angle
  Eigen::Vector3d middle_;               // of the circle
  double radius_ = 0;
};

}  // namespace nadir::render

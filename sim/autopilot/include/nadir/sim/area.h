#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::sim {

/// A part of the plan, (north, east) in metres: a simple polygon or a disc.
class Area {
 public:
  /// At least three corners in either sense, the last one joined to the first. Fails where edges cross or touch, or
  /// where a coordinate is not finite.
  static Result<Area> polygon(std::vector<Eigen::Vector2d> corners);
  /// Around its centre; `heading_rad` clockwise from north: where its length lies. Both lengths > 0.
  static Area rectangle(const Eigen::Vector2d& center, double length_m, double width_m, double heading_rad);
  static Area disc(const Eigen::Vector2d& center, double radius_m);  // radius > 0

  /// Whether a point lies in it and at least `margin_m` >= 0 from its edge.
  bool contains(const Eigen::Vector2d& point, double margin_m = 0) const;

  /// Radius of the largest disc in it, to a thousandth.
  double widest_m() const;

  Eigen::AlignedBox2d bounds() const;
  /// Of the polygon; of a disc those of a regular one around it, up to a thousandth of its radius larger.
  std::span<const Eigen::Vector2d> corners() const { return corners_; }

 private:
  Area() = default;
  std::vector<Eigen::Vector2d> corners_;
  Eigen::Vector2d center_ = Eigen::Vector2d::Zero();  // of a disc
  double radius_m_ = 0;                               // 0: a polygon
};

}  // namespace nadir::sim

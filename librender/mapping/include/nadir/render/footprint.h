#pragma once

#include <array>
#include <optional>
#include <vector>

#include "nadir/render/exact_chain.h"

namespace nadir::render {

/// A point that an image point sees.
struct GroundPoint {
  Eigen::Vector3d enu_m;
  Eigen::Vector2d lon_lat_rad;
  Eigen::Vector2d crs;  // NaN where the CRS is not defined there
};

/// What a frame covers on the ground.
struct Footprint {
  /// Of the image's outer corners (0,0), (W,0), (W,H), (0,H); empty where a corner sees no ground.
  std::array<std::optional<GroundPoint>, 4> corners;
  /// Around the part of the image that sees ground, clipped at the horizon, in the order of the corners, 16 points a
  /// side, not closed; empty where no ground is seen.
  std::vector<Eigen::Vector2d> outline_lon_lat_rad;
};

Footprint footprint(const ExactChain& chain, const geodesy::Projection& projection);

}  // namespace nadir::render

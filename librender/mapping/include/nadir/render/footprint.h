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

/// Places around an area of ground, longitudes and latitudes in radians, clockwise as seen from above: the area lies to
/// the right. Not closed: the last place joins the first.
using Outline = std::vector<Eigen::Vector2d>;

/// What a frame covers on the ground.
struct Footprint {
  /// Of the image's outer corners (0,0), (W,0), (W,H), (0,H); empty where a corner sees no ground.
  std::array<std::optional<GroundPoint>, 4> corners;
  /// Around what is seen: it ends at the image's edge, at the edge of what the lens shows, and at the horizon; empty
  /// where no ground is seen. It passes the corners in their order.
  Outline outline_lon_lat_rad;
  /// Fisheyes that look up see several parts, or a ring of ground around what they do not see: the outlines that are
  /// shorter than the one above.
  std::vector<Outline> more_outlines_lon_lat_rad;
};

/// Greatest distance on the ground between the exact outline and the straight lines in longitude and latitude from each
/// point to the next, over the greatest distance between two corners of the area (of a disc, of eight places around
/// it). Checked at three places on each line; kept unless that takes more than `most_outline_points`.
inline constexpr double outline_tolerance = 1e-3;
inline constexpr std::size_t most_outline_points = 2048;

Footprint footprint(const ExactChain& chain, const geodesy::Projection& projection);

}  // namespace nadir::render

#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "nadir/render/footprint.h"

namespace nadir::render {

/// Longitudes and latitudes in degrees, whole multiples of 1e-9 as nearly as doubles are; closed: the last is the
/// first.
using GeographicRing = std::vector<Eigen::Vector2d>;
/// The first ring surrounds the polygon, counter-clockwise; further ones are holes, clockwise.
using GeographicPolygon = std::vector<GeographicRing>;

/// The area that outlines surround, on a map from longitude -180 to 180 and latitude -90 to 90, as GeoJSON has it
/// (RFC 7946, sections 3.1.6 and 3.1.9).
///
/// Where it crosses the antimeridian it is cut there, and the parts touch -180 and 180. Around a pole it has edges
/// along both to that pole and along it. An outline may touch the antimeridian or run along it, pass a pole (a line
/// whose ends are half a turn apart does) or have a point there. The area is less than a hemisphere. No polygon where
/// there is nothing left at that precision; no ring without an area.
std::vector<GeographicPolygon> geographic_polygons(std::span<const Outline> outlines);

/// Of a footprint.
std::vector<GeographicPolygon> geographic_polygons(const Footprint& footprint);

}  // namespace nadir::render

#pragma once

#include <ogr_geometry.h>

#include <cmath>
#include <string>
#include <vector>

#include "nadir/render/geographic_polygon.h"

namespace nadir::test {

/// Polygons as GDAL has them: whether they are valid is asked of GEOS.
inline OGRMultiPolygon ogr_area(const std::vector<render::GeographicPolygon>& polygons) {
  OGRMultiPolygon area;
  for (const auto& polygon : polygons) {
    OGRPolygon part;
    for (const auto& ring : polygon) {
      OGRLinearRing line;
      for (const auto& p : ring) line.addPoint(p.x(), p.y());
      part.addRing(&line);
    }
    area.addGeometry(&part);
  }
  return area;
}

/// What RFC 7946 asks beyond that; empty where all is well.
inline std::string complaint(const std::vector<render::GeographicPolygon>& polygons) {
  for (const auto& polygon : polygons) {
    if (polygon.empty()) return "a polygon without a ring";
    for (std::size_t r = 0; r < polygon.size(); ++r) {
      const auto& ring = polygon[r];
      if (ring.size() < 4) return "a ring of less than four positions";
      if (ring.front() != ring.back()) return "a ring that is not closed";
      double area = 0;
      for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
        const Eigen::Vector2d a = ring[i] - ring[0], b = ring[i + 1] - ring[0];
        area += a.x() * b.y() - b.x() * a.y();
        if (!ring[i].allFinite()) return "a position that is not finite";
        if (!(std::abs(ring[i].x()) <= 180 && std::abs(ring[i].y()) <= 90)) return "a position off the map";
        if (ring[i] == ring[i + 1]) return "a position twice in a row";
      }
      if ((area > 0) != (r == 0)) return "a ring that turns the wrong way";
    }
  }
  if (polygons.empty()) return {};
  return ogr_area(polygons).IsValid() ? "" : "not valid, says GEOS";
}

}  // namespace nadir::test

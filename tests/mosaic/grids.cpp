#include "grids.h"

#include <ogr_spatialref.h>

#include <cmath>
#include <limits>
#include <memory>

namespace nadir::mosaic {

Grid north_up(const std::string& crs, double left, double top, double side, std::int64_t width, std::int64_t height) {
  Grid grid{geodesy::Projection::from_definition(crs).value(), crs, Eigen::Affine2d::Identity(), width, height};
  grid.crs_from_texel.linear() << side, 0, 0, -side;
  grid.crs_from_texel.translation() << left, top;
  return grid;
}

Grid around(const std::string& crs, double lon_deg, double lat_deg, double side, std::int64_t width,
            std::int64_t height) {
  std::vector<Eigen::Vector2d> middle = {{lon_deg, lat_deg}};
  transform_by_library("EPSG:4326", crs, middle);
  return north_up(crs, middle[0].x() - side * static_cast<double>(width) / 2,
                  middle[0].y() + side * static_cast<double>(height) / 2, side, width, height);
}

void transform_by_library(const std::string& from, const std::string& to, std::vector<Eigen::Vector2d>& points) {
  OGRSpatialReference a, b;
  a.SetFromUserInput(from.c_str());
  b.SetFromUserInput(to.c_str());
  a.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  b.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> t(OGRCreateCoordinateTransformation(&a, &b));
  std::vector<double> x, y;
  for (const auto& p : points) x.push_back(p.x()), y.push_back(p.y());
  std::vector<int> ok(points.size());
  if (t) t->Transform(static_cast<int>(points.size()), x.data(), y.data(), nullptr, ok.data());
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] =
        ok[i] ? Eigen::Vector2d(x[i], y[i]) : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
}

}  // namespace nadir::mosaic

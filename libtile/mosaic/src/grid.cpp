#include "nadir/mosaic/grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace nadir::mosaic {
namespace {

struct Bounds {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;

  void add(const Eigen::Vector2d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
};

bool is_north_up(const Eigen::Affine2d& grid) {
  return grid(0, 1) == 0 && grid(1, 0) == 0 && grid(0, 0) > 0 && grid(1, 1) < 0;
}

/// Points along the outline of a raster, `steps` a side.
std::vector<Eigen::Vector2d> outline(const Grid& grid, int steps) {
  std::vector<Eigen::Vector2d> points;
  const double w = static_cast<double>(grid.width), h = static_cast<double>(grid.height);
  for (int i = 0; i < steps; ++i) {
    const double t = static_cast<double>(i) / steps;
    for (const auto& p : {Eigen::Vector2d(t * w, 0), Eigen::Vector2d(w, t * h), Eigen::Vector2d((1 - t) * w, h),
                          Eigen::Vector2d(0, (1 - t) * h)})
      points.emplace_back(grid.crs_from_texel * p);
  }
  return points;
}

/// Bounds of a raster in another CRS: the outline divided until they stand still within a thousandth of their size, or
/// `within`, whichever is less.
Result<Bounds> bounds_in(const Grid& source, const std::string& label, const geodesy::Projection& target,
                         double within) {
  Bounds before;
  for (int steps = 16; steps <= 4096; steps *= 4) {
    std::vector<Eigen::Vector2d> points = outline(source, steps);
    if (!(source.projection == target)) {
      source.projection.lon_lat_from_crs(points);
      target.crs_from_lon_lat(points);
    }
    Bounds bounds;
    for (const Eigen::Vector2d& p : points) {
      if (!p.allFinite())
        return fail(Error::Kind::Unsupported,
                    fmt::format("{}: part of its outline is not defined in {}: choose another --crs, or an --extent",
                                label, target.name()));
      bounds.add(p);
    }
    const double change =
        std::max((bounds.low - before.low).cwiseAbs().maxCoeff(), (bounds.high - before.high).cwiseAbs().maxCoeff());
    before = bounds;
    if (change <= within) break;
  }
  return before;
}

/// Side of a texel of `source` in units of `target`, at the source's centre.
double texel_side(const Grid& source, const geodesy::Projection& target) {
  const Eigen::Vector2d centre(static_cast<double>(source.width) / 2, static_cast<double>(source.height) / 2);
  std::vector<Eigen::Vector2d> points = {source.crs_from_texel * centre,
                                         source.crs_from_texel * (centre + Eigen::Vector2d(1, 0)),
                                         source.crs_from_texel * (centre + Eigen::Vector2d(0, 1))};
  if (!(source.projection == target)) {
    source.projection.lon_lat_from_crs(points);
    target.crs_from_lon_lat(points);
  }
  return std::min((points[1] - points[0]).norm(), (points[2] - points[0]).norm());
}

/// The first source's grid, enlarged by whole texels to hold all.
Result<Grid> enlarged(std::span<const Grid> sources, std::span<const std::string> labels) {
  Grid grid = sources.front();
  const Eigen::Affine2d texel_from_crs = grid.crs_from_texel.inverse();
  Bounds all;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    // In texels of the grid, which stays as it is turned
    Bounds bounds;
    if (sources[i].projection == grid.projection) {
      for (const Eigen::Vector2d& p : outline(sources[i], 1)) bounds.add(texel_from_crs * p);
    } else {
      const double step = std::abs(grid.crs_from_texel.linear().determinant());
      auto in_crs = bounds_in(sources[i], labels[i], grid.projection, 0.1 * std::sqrt(step));
      if (!in_crs) return fail(in_crs);
      for (const double x : {in_crs->low.x(), in_crs->high.x()})
        for (const double y : {in_crs->low.y(), in_crs->high.y()}) bounds.add(texel_from_crs * Eigen::Vector2d(x, y));
    }
    all.add(bounds.low);
    all.add(bounds.high);
  }
  // What reaches less than a twentieth of a texel further lies on the grid.
  const Eigen::Vector2d low = (all.low.array() + 0.05).floor(), high = (all.high.array() - 0.05).ceil();
  grid.crs_from_texel.translate(low);
  if (!((high - low).maxCoeff() < 9e15))
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: lies too far from the other sources for one map", labels.back()));
  grid.width = static_cast<std::int64_t>(high.x() - low.x());
  grid.height = static_cast<std::int64_t>(high.y() - low.y());
  return grid;
}

}  // namespace

Result<Grid> common_grid(std::span<const Grid> sources, std::span<const std::string> labels,
                         const GridOptions& options) {
  const Grid& first = sources.front();
  if (options.gsd && !(*options.gsd > 0 && std::isfinite(*options.gsd)))
    return fail(Error::Kind::Malformed, fmt::format("gsd {}: expected more than 0", *options.gsd));
  if (options.crs.empty() && !options.gsd && !options.extent) return enlarged(sources, labels);

  Grid grid = first;
  if (!options.crs.empty()) {
    auto projection = geodesy::Projection::from_definition(options.crs);
    if (!projection) return fail(projection);
    // A map that reaches over the antimeridian has longitudes around that of the first source.
    std::vector<Eigen::Vector2d> centre = {
        first.crs_from_texel *
        Eigen::Vector2d(static_cast<double>(first.width) / 2, static_cast<double>(first.height) / 2)};
    first.projection.lon_lat_from_crs(centre);
    projection->crs_from_lon_lat(centre);
    if (centre.front().allFinite()) projection->wrap_around(centre.front().x());
    if (!(*projection == first.projection)) {
      grid.projection = *projection;
      grid.definition = options.crs;
    }
  }
  const bool keeps_lattice = grid.projection == first.projection && !options.gsd && is_north_up(first.crs_from_texel);
  double gsd_x = first.crs_from_texel(0, 0), gsd_y = -first.crs_from_texel(1, 1);
  if (options.gsd) {
    gsd_x = gsd_y = *options.gsd;
  } else if (!keeps_lattice) {
    double finest = std::numeric_limits<double>::infinity();
    for (const Grid& source : sources) {
      const double side = texel_side(source, grid.projection);
      if (side > 0) finest = std::min(finest, side);
    }
    if (!std::isfinite(finest))
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: its centre is not defined in {}: choose another --crs, or give --gsd",
                              labels.front(), grid.projection.name()));
    gsd_x = gsd_y = finest;
  }

  Bounds all;
  if (options.extent) {
    all.add({(*options.extent)[0], (*options.extent)[1]});
    all.add({(*options.extent)[2], (*options.extent)[3]});
  } else {
    for (std::size_t i = 0; i < sources.size(); ++i) {
      auto bounds = bounds_in(sources[i], labels[i], grid.projection, 0.1 * std::min(gsd_x, gsd_y));
      if (!bounds) return fail(bounds);
      all.add(bounds->low);
      all.add(bounds->high);
    }
  }
  // Lines of texels pass through the first source's corner, or through whole multiples of the gsd.
  const Eigen::Vector2d anchor = keeps_lattice ? first.crs_from_texel.translation() : Eigen::Vector2d(0, 0);
  const bool exact = options.extent && !keeps_lattice;
  const double left = exact ? all.low.x() : anchor.x() + gsd_x * std::floor((all.low.x() - anchor.x()) / gsd_x + 0.001);
  const double top = exact ? all.high.y() : anchor.y() + gsd_y * std::ceil((all.high.y() - anchor.y()) / gsd_y - 0.001);
  const double columns = std::ceil((all.high.x() - left) / gsd_x - 0.001);
  const double rows = std::ceil((top - all.low.y()) / gsd_y - 0.001);
  if (!(std::max(columns, rows) < 9e15) || !(std::min(columns, rows) >= 1))
    return fail(Error::Kind::Unsupported,
                fmt::format("a grid of {} x {} texels: choose another --gsd or --extent", columns, rows));
  grid.crs_from_texel.matrix() << gsd_x, 0, left, 0, -gsd_y, top, 0, 0, 1;
  grid.width = static_cast<std::int64_t>(columns);
  grid.height = static_cast<std::int64_t>(rows);
  return grid;
}

}  // namespace nadir::mosaic

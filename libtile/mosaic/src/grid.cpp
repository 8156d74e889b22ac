#include "nadir/mosaic/grid.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "exact_mapping.h"

namespace nadir::mosaic {
namespace {

/// Texels that an outline may pass the last whole one by, and none is added for it: no centre lies there.
constexpr double slack_texels = 0.05;

bool is_north_up(const Grid& grid) {
  const auto& m = grid.crs_from_texel.linear();
  return m(0, 1) == 0 && m(1, 0) == 0 && m(0, 0) > 0 && m(1, 1) < 0;
}

/// Side of a square as large as a texel that this matrix spans.
double side(const Eigen::Matrix2d& crs_from_texel) { return std::sqrt(std::abs(crs_from_texel.determinant())); }

/// Source texels to the map's CRS, with longitudes on the turn on which the source lies nearest to the first one.
class IntoCrs {
 public:
  IntoCrs(const Grid& source, const geodesy::Projection& crs) : source_(source), from_(source.projection), into_(crs) {
    from_.wrap_around(center(source).x());
    same_ = same_crs(source.projection, crs);
    std::array<Eigen::Vector2d, 1> middle = {center(source)};
    if (same_) {
      if (const auto turn = crs.turn()) {
        auto wrapped = middle;
        from_.lon_lat_from_crs(wrapped);
        into_.crs_from_lon_lat(wrapped);
        turns_ = *turn * std::round((wrapped[0].x() - middle[0].x()) / *turn);
      }
      return;
    }
    from_.lon_lat_from_crs(middle);
    into_.crs_from_lon_lat(middle);
    if (middle[0].allFinite()) into_.wrap_around(middle[0].x());
  }

  bool same() const { return same_; }
  double turns() const { return turns_; }  // to be added to x where the CRS is the same

  /// In place, texels to CRS units.
  void operator()(std::span<Eigen::Vector2d> points) const {
    for (auto& p : points) p = source_.crs_from_texel * p;
    if (same_) {
      for (auto& p : points) p.x() += turns_;
    } else {
      from_.lon_lat_from_crs(points);
      into_.crs_from_lon_lat(points);
    }
  }

  /// WGS-84 degrees of a texel, for messages.
  Eigen::Vector2d lon_lat_deg(const Eigen::Vector2d& texel) const {
    std::array<Eigen::Vector2d, 1> p = {source_.crs_from_texel * texel};
    from_.lon_lat_from_crs(p);
    return {geodesy::to_degrees(p[0].x()), geodesy::to_degrees(p[0].y())};
  }

  /// Side of a texel in the middle of the source, CRS units; NaN where that is not defined.
  double texel_side() const {
    if (same_) return side(source_.crs_from_texel.linear());
    const Eigen::Vector2d m(static_cast<double>(source_.width) / 2, static_cast<double>(source_.height) / 2);
    std::array<Eigen::Vector2d, 4> around = {m + Eigen::Vector2d(0.5, 0), m - Eigen::Vector2d(0.5, 0),
                                             m + Eigen::Vector2d(0, 0.5), m - Eigen::Vector2d(0, 0.5)};
    (*this)(around);
    Eigen::Matrix2d jacobian;
    jacobian << around[0] - around[1], around[2] - around[3];
    return side(jacobian);
  }

 private:
  const Grid& source_;
  geodesy::Projection from_, into_;
  bool same_ = false;
  double turns_ = 0;
};

/// Bounds of a source in the map's CRS, within a tenth of `texel` CRS units.
Result<Eigen::AlignedBox2d> bounds(const Grid& source, const std::string& label, const Grid& map, double texel) {
  const IntoCrs into(source, map.projection);
  Eigen::AlignedBox2d box;
  const auto undefined = [&](const Eigen::Vector2d& lon_lat_deg) {
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: at longitude {:.6g}, latitude {:.6g} its outline is not defined in {}; choose another "
                            "CRS with --crs, or limit the map with --extent",
                            label, lon_lat_deg.x(), lon_lat_deg.y(), map.projection.name()));
  };
  for (int sides = into.same() ? 1 : 20; sides <= 1280; sides *= 2) {
    const auto texels = outline(source, sides);
    auto points = texels;
    into(points);
    const Eigen::AlignedBox2d before = box;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!points[i].allFinite()) return undefined(into.lon_lat_deg(texels[i]));
      box.extend(points[i]);
    }
    if (into.same()) return box;
    const bool first = sides == 20;
    const double moved = std::max((before.min() - box.min()).maxCoeff(), (box.max() - before.max()).maxCoeff());
    if (!first && moved < 0.1 * texel) break;
  }

  // A pole within is farther out than all of the outline.
  for (const double lat_deg : {-90.0, 90.0}) {
    if (!holds_pole(source, lat_deg)) continue;
    std::array<Eigen::Vector2d, 1> pole = {Eigen::Vector2d(0, geodesy::to_radians(lat_deg))};
    map.projection.crs_from_lon_lat(pole);
    if (!pole[0].allFinite()) return undefined({0, lat_deg});
    if (const auto turn = map.projection.turn()) {
      const double middle = box.center().x();
      box.extend(Eigen::Vector2d(middle - *turn / 2, pole[0].y()));
      box.extend(Eigen::Vector2d(middle + *turn / 2, pole[0].y()));
    } else {
      box.extend(pole[0]);
    }
  }
  return box;
}

/// What a user typed, checked, a map across the antimeridian made to have its right edge on the right.
Result<std::array<double, 4>> checked_extent(std::array<double, 4> extent, const geodesy::Projection& crs) {
  if (const auto turn = crs.turn(); turn && extent[2] < extent[0]) extent[2] += *turn;
  if (std::all_of(extent.begin(), extent.end(), [](double v) { return std::isfinite(v); }) && extent[0] < extent[2] &&
      extent[1] < extent[3])
    return extent;
  return fail(Error::Kind::Malformed, fmt::format("extent {},{},{},{}: expected left,bottom,right,top in units of {}, "
                                                  "left less than right and bottom less than top",
                                                  extent[0], extent[1], extent[2], extent[3], crs.name()));
}

/// Texels of the map and where they start: the source that has the finest among those in its CRS, or squares of a side
/// that a source in another CRS or the user calls for, at whole multiples of it.
Result<Eigen::Affine2d> lattice_of(std::span<const Grid> sources, std::span<const std::string> labels,
                                   const geodesy::Projection& crs, const std::optional<double>& gsd) {
  const auto squares = [](double s) { return Eigen::Affine2d(Eigen::Scaling(s, -s)); };
  if (gsd) return squares(*gsd);
  std::optional<Eigen::Affine2d> base;
  double finest = std::numeric_limits<double>::infinity(), finest_elsewhere = finest;
  for (const Grid& source : sources) {
    const IntoCrs into(source, crs);
    const double texel = into.texel_side();
    if (into.same() && is_north_up(source)) {
      if (texel >= finest * 0.99) continue;  // the first of those that are alike
      finest = texel;
      base = Eigen::Translation2d(into.turns(), 0) * source.crs_from_texel;
    } else if (texel < finest_elsewhere) {
      finest_elsewhere = texel;
    }
  }
  // Texels of one product differ by some per cent between UTM zones: that is no reason to resample all of them.
  if (base && finest_elsewhere > 0.9 * finest) return *base;
  if (base || std::isfinite(finest_elsewhere)) return squares(std::min(finest, finest_elsewhere));
  return fail(Error::Kind::Unsupported,
              fmt::format("{}: its middle is not defined in {}, so that the size of a texel is unknown; choose another "
                          "CRS with --crs, or the size with --gsd",
                          labels.front(), crs.name()));
}

/// The grid on `crs_from_texel`, continued in all directions, that holds `box`.
Result<Grid> enclose(Grid map, const Eigen::Affine2d& crs_from_texel, const Eigen::AlignedBox2d& box, double slack,
                     std::span<const std::string> labels) {
  const double dx = crs_from_texel(0, 0), dy = crs_from_texel(1, 1);  // north-up: dy < 0
  const Eigen::Vector2d origin = crs_from_texel.translation();
  const double left = std::floor((box.min().x() - origin.x()) / dx + slack);
  const double right = std::ceil((box.max().x() - origin.x()) / dx - slack);
  const double top = std::floor((box.max().y() - origin.y()) / dy + slack);
  const double bottom = std::ceil((box.min().y() - origin.y()) / dy - slack);
  const double width = std::max(1.0, right - left), height = std::max(1.0, bottom - top);
  constexpr double most = std::numeric_limits<std::int32_t>::max();
  if (!(width <= most && height <= most))
    return fail(Error::Kind::Unsupported,
                fmt::format("{}{}: the map that holds all would have {:.0f} x {:.0f} texels, more than {:.0f} a side; "
                            "choose larger texels with --gsd, or limit it with --extent",
                            labels.front(), labels.size() > 1 ? fmt::format(" and {} more", labels.size() - 1) : "",
                            width, height, most));
  map.crs_from_texel = crs_from_texel;
  map.crs_from_texel.translation() = origin + Eigen::Vector2d(left * dx, top * dy);
  map.width = static_cast<std::int64_t>(width);
  map.height = static_cast<std::int64_t>(height);
  return map;
}

Result<void> check(std::span<const Grid> sources, std::span<const std::string> labels, const GridOptions& options) {
  if (sources.empty()) return fail(Error::Kind::NotFound, "expected at least one source to make a map of, found none");
  for (std::size_t i = 0; i < sources.size(); ++i)
    if (!sources[i].crs_from_texel.matrix().allFinite() || !(side(sources[i].crs_from_texel.linear()) > 0))
      return fail(Error::Kind::Malformed,
                  fmt::format("{}: expected a geotransform that spans an area, found texels of no size", labels[i]));
  if (options.gsd && !(std::isfinite(*options.gsd) && *options.gsd > 0))
    return fail(Error::Kind::Malformed, fmt::format("gsd {}: expected a number above 0", *options.gsd));
  return {};
}

/// The CRS of the map, longitudes around the middle of its extent or of the first source.
Result<geodesy::Projection> map_crs(const Grid& first, const GridOptions& options) {
  auto crs = options.crs.empty() ? Result<geodesy::Projection>(first.projection)
                                 : geodesy::Projection::from_definition(options.crs);
  if (!crs) return crs;
  if (same_crs(*crs, first.projection)) {
    crs->wrap_around(center(first).x());
  } else {
    std::array<Eigen::Vector2d, 1> middle = {center(first)};
    first.projection.lon_lat_from_crs(middle);
    crs->crs_from_lon_lat(middle);
    if (middle[0].allFinite()) crs->wrap_around(middle[0].x());
  }
  return crs;
}

}  // namespace

Result<Grid> common_grid(std::span<const Grid> sources, std::span<const std::string> labels,
                         const GridOptions& options) {
  if (const auto ok = check(sources, labels, options); !ok) return fail(ok);
  auto crs = map_crs(sources.front(), options);
  if (!crs) return fail(crs);
  const bool own = same_crs(*crs, sources.front().projection);
  Grid map = sources.front();
  map.projection = *crs;
  if (sources.size() == 1 && own && !options.gsd && !options.extent) return map;
  if (!own) map.definition = options.crs;
  if (options.extent) {
    const auto extent = checked_extent(*options.extent, *crs);
    if (!extent) return fail(extent);
    map.projection.wrap_around(((*extent)[0] + (*extent)[2]) / 2);
    const Eigen::AlignedBox2d box(Eigen::Vector2d((*extent)[0], (*extent)[1]),
                                  Eigen::Vector2d((*extent)[2], (*extent)[3]));
    constexpr double rounding = 1e-6;  // of an extent that is whole texels but for the last bits
    const auto texels = lattice_of(sources, labels, map.projection, options.gsd);
    if (!texels) return fail(texels);
    return enclose(map, *texels, box, rounding, labels);
  }

  const auto texels = lattice_of(sources, labels, map.projection, options.gsd);
  if (!texels) return fail(texels);
  Eigen::AlignedBox2d box;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const auto one = bounds(sources[i], labels[i], map, side(texels->linear()));
    if (!one) return fail(one);
    box.extend(*one);
  }
  if (const auto turn = crs->turn(); turn && box.max().x() - box.min().x() > *turn)
    box.max().x() = box.min().x() + *turn;  // once around is all there is
  return enclose(map, *texels, box, slack_texels, labels);
}

}  // namespace nadir::mosaic

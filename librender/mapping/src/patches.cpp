#include "nadir/render/patches.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace nadir::render {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Where within a unit square a homography through its corners is checked.
constexpr std::array<std::array<double, 2>, 9> checked_places = {
    {{0.5, 0.5}, {0.5, 0}, {1, 0.5}, {0.5, 1}, {0, 0.5}, {0.25, 0.25}, {0.75, 0.25}, {0.75, 0.75}, {0.25, 0.75}}};

Eigen::Vector3d normal_at(const Eigen::Vector2d& lon_lat_rad) {
  const double lon = lon_lat_rad.x(), lat = lon_lat_rad.y();
  return {std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
}
double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

class Builder {
 public:
  Builder(const ExactChain& chain, const geodesy::Projection& projection, double tolerance_px,
          const std::vector<GroundExtent>& extents, const RowRange& rows)
      : chain_(chain), projection_(projection), extents_(extents), rows_(rows) {
    if (chain.flat()) plane_from_image_ = chain.plane_from_image();
    for (const double row : chain.kinks()) kink_rows_.push_back(static_cast<int>(std::floor(row)));
    mapping_.tolerance_px = tolerance_px;
  }

  void add(const PixelRect& rect) {
    if (!rows_.meets(rect)) return;
    if (const auto kink = std::lower_bound(kink_rows_.begin(), kink_rows_.end(), rect.y);
        kink != kink_rows_.end() && *kink < rect.y + rect.height)
      return add_around(*kink, rect);
    if (sees_no_ground(rect)) return push({rect, Patch::Kind::NoGround});
    if (is_off_map(rect)) return push({rect, Patch::Kind::OffMap});
    if (auto patch = fit(rect)) return push(std::move(*patch));
    if (rect.width <= smallest_patch_px && rect.height <= smallest_patch_px) return push(per_pixel(rect));
    const auto [first, second] = halves(rect);
    add(first);
    add(second);
  }

  PatchMapping take() { return std::move(mapping_); }

 private:
  static std::array<Eigen::Vector2d, 4> corners_of(const PixelRect& r) {
    const double x = r.x, y = r.y, w = r.width, h = r.height;
    return {Eigen::Vector2d(x, y), {x + w, y}, {x + w, y + h}, {x, y + h}};
  }

  void push(Patch patch) {
    mapping_.error_px = std::max(mapping_.error_px, patch.error_px);
    mapping_.patches.push_back(std::move(patch));
  }

  static Eigen::AlignedBox2d box_of(const PixelRect& r) {
    return {Eigen::Vector2d(r.x, r.y), Eigen::Vector2d(r.x + r.width, r.y + r.height)};
  }

  bool sees_no_ground(const PixelRect& rect) const { return chain_.look(box_of(rect)) == Sight::None; }

  /// True only where it is certain: all of the rectangle sees ground, within a convex quadrangle whose bounds meet no
  /// map.
  bool is_off_map(const PixelRect& rect) const {
    if (extents_.empty() || chain_.rolling()) return false;
    if (chain_.surface().ellipsoid()) return is_off_every_cap(rect);
    if (!chain_.flat()) return false;
    Eigen::AlignedBox2d seen;
    for (const auto& corner : corners_of(rect)) {
      if (!(chain_.visibility(corner) > 0)) return false;
      seen.extend(apply(plane_from_image_, corner));
    }
    return std::none_of(extents_.begin(), extents_.end(),
                        [&](const GroundExtent& e) { return !e.bounded || e.box.intersects(seen); });
  }

  /// Likewise on an ellipsoid, by angles between normals: what the rectangle sees lies within a cap around what its
  /// middle sees, which reaches as far as its corners and edges do and a third more.
  bool is_off_every_cap(const PixelRect& rect) const {
    const auto meets = [&](const GroundExtent& e, const Eigen::Vector3d& normal, double radius) {
      return !e.bounded || angle_between(e.normal, normal) <= e.radius_rad + radius;
    };
    if (chain_.look(box_of(rect)) != Sight::All) return false;
    std::array<Eigen::Vector2d, 9> image, lon_lat;
    const Eigen::AlignedBox2d box = box_of(rect);
    for (int i = 0; i < 9; ++i)
      image[static_cast<std::size_t>(i)] = box.min() + box.sizes().cwiseProduct(Eigen::Vector2d(i % 3, i / 3) / 2);
    chain_.lon_lat_from_image(image, lon_lat);
    double radius = 0;
    for (const auto& p : lon_lat) {
      if (!p.allFinite()) return false;
      radius = std::max(radius, angle_between(normal_at(p), normal_at(lon_lat[4])));
    }
    return std::none_of(extents_.begin(), extents_.end(), [&](const GroundExtent& e) {
      return meets(e, normal_at(lon_lat[4]), 4.0 / 3 * radius + 1e-7);
    });
  }

  /// A homography or quadratics, where one of them is within the tolerance.
  std::optional<Patch> fit(const PixelRect& rect) {
    const auto corners = corners_of(rect);
    for (const auto& corner : corners)
      if (!(chain_.visibility(corner) > 0)) return std::nullopt;
    std::array<Eigen::Vector2d, 4 + checked_places.size()> image, crs;
    std::copy(corners.begin(), corners.end(), image.begin());
    for (std::size_t i = 0; i < checked_places.size(); ++i) image[4 + i] = at(rect, checked_places[i]);
    chain_.crs_from_image(projection_, image, crs);
    mapping_.exact_points += static_cast<std::int64_t>(image.size());
    const std::span<const Eigen::Vector2d> checked_image = std::span(image).subspan(4),
                                           checked_crs = std::span(crs).subspan(4);

    const Eigen::Vector2d origin = crs[0];
    const auto h = homography_from_rectangle(
        rect.width, rect.height, {Eigen::Vector2d::Zero(), crs[1] - origin, crs[2] - origin, crs[3] - origin});
    if (h) {
      const double error_px = greatest_error(
          rect, origin, checked_image, checked_crs, [&](const Eigen::Vector2d& p) { return apply(*h, p); },
          [&](const Eigen::Vector2d& p) { return jacobian(*h, p); });
      if (error_px <= 0.5 * mapping_.tolerance_px) {
        Patch patch{rect, Patch::Kind::Homography};
        patch.crs_from_image = *h;
        patch.crs_origin = origin;
        patch.error_px = error_px;
        return patch;
      }
    }
    return fit_biquadratic(rect, crs);
  }

  /// `crs`: of the corners, then of the middle and the edges' middles, as `fit` has them.
  std::optional<Patch> fit_biquadratic(const PixelRect& rect, std::span<const Eigen::Vector2d> crs) {
    const Eigen::Vector2d origin = crs[0];
    constexpr std::array<std::size_t, 9> lattice = {0, 5, 1, 8, 4, 6, 3, 7, 2};
    std::array<Eigen::Vector2d, 9> values;
    for (std::size_t i = 0; i < 9; ++i) {
      values[i] = crs[lattice[i]] - origin;
      if (!values[i].allFinite()) return std::nullopt;
    }
    const Biquadratic quadratics(rect.width, rect.height, values);
    const auto value_at = [&](const Eigen::Vector2d& p) { return quadratics(p); };
    const auto jacobian_at = [&](const Eigen::Vector2d& p) { return quadratics.jacobian(p); };
    // The quarter points are there already; most rectangles that are too large fail at them
    std::array<Eigen::Vector2d, 4> quarters;
    for (std::size_t i = 0; i < 4; ++i) quarters[i] = at(rect, checked_places[5 + i]);
    double error_px = greatest_error(rect, origin, quarters, crs.subspan(9), value_at, jacobian_at);
    if (!(error_px <= 0.5 * mapping_.tolerance_px)) return std::nullopt;

    std::array<Eigen::Vector2d, 16> image, between;
    std::size_t count = 0;
    for (const double a : {0.2113, 0.7887}) {
      for (const double b : {0.0, 0.5, 1.0}) {
        image[count++] = at(rect, {a, b});
        image[count++] = at(rect, {b, a});
      }
      for (const double b : {0.2113, 0.7887}) image[count++] = at(rect, {a, b});
    }
    chain_.crs_from_image(projection_, image, between);
    mapping_.exact_points += static_cast<std::int64_t>(image.size());
    error_px = std::max(error_px, greatest_error(rect, origin, image, between, value_at, jacobian_at));
    if (!(error_px <= 0.5 * mapping_.tolerance_px)) return std::nullopt;
    Patch patch{rect, Patch::Kind::Biquadratic};
    patch.biquadratic = quadratics;
    patch.crs_origin = origin;
    patch.error_px = error_px;
    return patch;
  }

  static Eigen::Vector2d at(const PixelRect& rect, const std::array<double, 2>& place) {
    return {rect.x + place[0] * rect.width, rect.y + place[1] * rect.height};
  }

  /// Backward: how far in the image an approximation of CRS coordinates lies from the right ones; infinite where there
  /// are none.
  template <class Value, class Jacobian>
  static double greatest_error(const PixelRect& rect, const Eigen::Vector2d& origin,
                               std::span<const Eigen::Vector2d> image, std::span<const Eigen::Vector2d> crs,
                               Value&& value_at, Jacobian&& jacobian_at) {
    double error_px = 0;
    for (std::size_t i = 0; i < image.size(); ++i) {
      const Eigen::Vector2d offset = image[i] - Eigen::Vector2d(rect.x, rect.y);
      const Eigen::Vector2d forward_error = crs[i] - origin - value_at(offset);
      const double backward = (jacobian_at(offset).inverse() * forward_error).norm();
      error_px = std::max(error_px, std::isfinite(backward) ? backward : infinity);
    }
    return error_px;
  }

  Patch per_pixel(const PixelRect& rect) {
    Patch patch{rect, Patch::Kind::PerPixel};
    std::vector<Eigen::Vector2d> image;
    for (int y = 0; y < rect.height; ++y)
      for (int x = 0; x < rect.width; ++x) image.emplace_back(rect.x + x + 0.5, rect.y + y + 0.5);
    patch.crs.resize(image.size());
    chain_.crs_from_image(projection_, image, patch.crs);
    mapping_.exact_points += static_cast<std::int64_t>(image.size());
    return patch;
  }

  /// A row in which the poses of a rolling shutter change their velocity is smooth nowhere but at its pixels.
  void add_around(int row, const PixelRect& rect) {
    if (row > rect.y) add({rect.x, rect.y, rect.width, row - rect.y});
    const bool meets = rows_.meets({rect.x, row, rect.width, 1});
    for (int x = rect.x; meets && x < rect.x + rect.width; x += block_px)
      push(per_pixel({x, row, std::min(block_px, rect.x + rect.width - x), 1}));
    if (row + 1 < rect.y + rect.height) add({rect.x, row + 1, rect.width, rect.y + rect.height - row - 1});
  }

  /// Two parts across the longer side, cut at a multiple of the block where there is one inside, else of the smallest
  /// patch.
  static std::array<PixelRect, 2> halves(const PixelRect& rect) {
    const bool wide = rect.width >= rect.height;
    const int start = wide ? rect.x : rect.y, length = wide ? rect.width : rect.height;
    const int unit = length > block_px ? block_px : smallest_patch_px;
    int cut = (start + length / 2 + unit / 2) / unit * unit - start;
    if (cut <= 0 || cut >= length) cut = length / 2;
    return rect.cut_at(cut);
  }

  const ExactChain& chain_;
  const geodesy::Projection& projection_;
  const std::vector<GroundExtent>& extents_;
  const RowRange rows_;
  Eigen::Matrix3d plane_from_image_ = Eigen::Matrix3d::Zero();  // of flat chains
  std::vector<int> kink_rows_;                                  // rising
  PatchMapping mapping_;
};

}  // namespace

PatchMapping map_patches(const ExactChain& chain, const geodesy::Projection& projection, double tolerance_px,
                         const std::vector<GroundExtent>& extents, const RowRange& rows) {
  Builder builder(chain, projection, tolerance_px, extents, rows);
  builder.add({0, 0, chain.camera().width_px(), chain.camera().height_px()});
  return builder.take();
}

namespace {

/// Longitudes and latitudes of a rectangle's outline, and of places within it, of texels.
std::vector<Eigen::Vector2d> places_of(const geodesy::Projection& projection, const Eigen::Affine2d& crs_from_texel,
                                       double width, double height) {
  constexpr int steps = 32;  // a side: an outline's bulge between them is below a thousandth of the side's own
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    for (const Eigen::Vector2d& t : {Eigen::Vector2d(s * width, 0), Eigen::Vector2d(width, s * height),
                                     Eigen::Vector2d((1 - s) * width, height), Eigen::Vector2d(0, (1 - s) * height)})
      places.push_back(crs_from_texel * t);
  }
  for (int i = 1; i < 8; ++i)
    for (int j = 1; j < 8; ++j) places.push_back(crs_from_texel * Eigen::Vector2d(i * width / 8, j * height / 8));
  projection.lon_lat_from_crs(places);
  return places;
}

GroundExtent cap_around(const std::vector<Eigen::Vector2d>& places) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : places) sum += normal_at(p);
  GroundExtent extent;
  extent.normal = sum.normalized();
  for (const auto& p : places)
    extent.radius_rad = std::max(extent.radius_rad, angle_between(extent.normal, normal_at(p)));
  extent.radius_rad = 1.01 * extent.radius_rad + 1e-9;
  // A cap of more than a hemisphere need not hold what lies within its outline
  extent.bounded = sum.norm() > 0.3 * static_cast<double>(places.size()) && extent.radius_rad < 1.4;
  return extent;
}

}  // namespace

GroundExtent ground_extent(const Surface& surface, const geodesy::Projection& projection,
                           const Eigen::Affine2d& crs_from_texel, double width, double height) {
  const auto places = places_of(projection, crs_from_texel, width, height);
  GroundExtent unbounded;
  unbounded.bounded = false;
  if (std::any_of(places.begin(), places.end(), [](const auto& p) { return !p.allFinite(); })) return unbounded;
  const Plane* plane = surface.plane();
  if (!plane) return cap_around(places);
  GroundExtent extent;
  for (const auto& p : places) {
    const auto point = plane->at(p.x(), p.y());
    if (!point) return unbounded;
    extent.box.extend(Eigen::Vector2d(point->xyz.head<2>()));
  }
  const Eigen::Vector2d margin = 0.01 * extent.box.sizes();
  extent.box.min() -= margin;
  extent.box.max() += margin;
  return extent;
}

}  // namespace nadir::render

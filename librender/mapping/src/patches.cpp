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

class Builder {
 public:
  Builder(const ExactChain& chain, const geodesy::Projection& projection, double tolerance_px,
          const std::vector<PlaneExtent>& extents)
      : chain_(chain), projection_(projection), extents_(extents), plane_from_image_(chain.plane_from_image()) {
    mapping_.tolerance_px = tolerance_px;
  }

  void add(const PixelRect& rect) {
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

  bool sees_no_ground(const PixelRect& rect) const {
    const auto corners = corners_of(rect);
    return std::all_of(corners.begin(), corners.end(), [&](const auto& c) { return !(chain_.visibility(c) > 0); });
  }

  /// True only where it is certain: all of the rectangle sees ground, within a convex quadrangle whose bounds meet no
  /// map.
  bool is_off_map(const PixelRect& rect) const {
    if (extents_.empty()) return false;
    Eigen::AlignedBox2d seen;
    for (const auto& corner : corners_of(rect)) {
      if (!(chain_.visibility(corner) > 0)) return false;
      seen.extend(apply(plane_from_image_, corner));
    }
    return std::none_of(extents_.begin(), extents_.end(),
                        [&](const PlaneExtent& e) { return !e.bounded || e.box.intersects(seen); });
  }

  /// A homography through the rectangle's corners, if it is within the tolerance.
  std::optional<Patch> fit(const PixelRect& rect) {
    std::array<Eigen::Vector2d, 4 + checked_places.size()> image, crs;
    const auto corners = corners_of(rect);
    std::copy(corners.begin(), corners.end(), image.begin());
    for (std::size_t i = 0; i < checked_places.size(); ++i)
      image[4 + i] =
          corners[0] + Eigen::Vector2d(checked_places[i][0] * rect.width, checked_places[i][1] * rect.height);
    for (const auto& corner : corners)
      if (!(chain_.visibility(corner) > 0)) return std::nullopt;
    chain_.crs_from_image(projection_, image, crs);
    mapping_.exact_points += static_cast<std::int64_t>(image.size());

    const Eigen::Vector2d origin = crs[0];
    const auto h = homography_from_rectangle(
        rect.width, rect.height, {Eigen::Vector2d::Zero(), crs[1] - origin, crs[2] - origin, crs[3] - origin});
    if (!h) return std::nullopt;
    double error_px = 0;
    for (std::size_t i = 4; i < image.size(); ++i) {
      const Eigen::Vector2d offset = image[i] - corners[0];
      const Eigen::Vector2d forward_error = crs[i] - origin - apply(*h, offset);
      const double backward = (jacobian(*h, offset).inverse() * forward_error).norm();
      error_px = std::max(error_px, std::isfinite(backward) ? backward : infinity);
    }
    if (!(error_px <= 0.5 * mapping_.tolerance_px)) return std::nullopt;
    Patch patch{rect, Patch::Kind::Homography};
    patch.crs_from_image = *h;
    patch.crs_origin = origin;
    patch.error_px = error_px;
    return patch;
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

  /// Two parts across the longer side, cut at a multiple of the block where there is one inside, else of the smallest
  /// patch.
  static std::pair<PixelRect, PixelRect> halves(const PixelRect& rect) {
    const bool wide = rect.width >= rect.height;
    const int start = wide ? rect.x : rect.y, length = wide ? rect.width : rect.height;
    const int unit = length > block_px ? block_px : smallest_patch_px;
    int cut = (start + length / 2 + unit / 2) / unit * unit - start;
    if (cut <= 0 || cut >= length) cut = length / 2;
    PixelRect first = rect, second = rect;
    (wide ? first.width : first.height) = cut;
    (wide ? second.x : second.y) += cut;
    (wide ? second.width : second.height) -= cut;
    return {first, second};
  }

  const ExactChain& chain_;
  const geodesy::Projection& projection_;
  const std::vector<PlaneExtent>& extents_;
  const Eigen::Matrix3d plane_from_image_;
  PatchMapping mapping_;
};

}  // namespace

PatchMapping map_patches(const ExactChain& chain, const geodesy::Projection& projection, double tolerance_px,
                         const std::vector<PlaneExtent>& extents) {
  Builder builder(chain, projection, tolerance_px, extents);
  builder.add({0, 0, chain.camera().width_px(), chain.camera().height_px()});
  return builder.take();
}

PlaneExtent plane_extent(const Plane& plane, const geodesy::Projection& projection,
                         const Eigen::Affine2d& crs_from_texel, double width, double height) {
  constexpr int steps = 32;  // a side: an outline's bulge between them is below a thousandth of the side's own
  std::vector<Eigen::Vector2d> outline;
  for (int i = 0; i < steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    for (const Eigen::Vector2d& t : {Eigen::Vector2d(s * width, 0), Eigen::Vector2d(width, s * height),
                                     Eigen::Vector2d((1 - s) * width, height), Eigen::Vector2d(0, (1 - s) * height)})
      outline.push_back(crs_from_texel * t);
  }
  projection.lon_lat_from_crs(outline);
  PlaneExtent extent;
  for (const auto& p : outline) {
    const auto point = p.allFinite() ? plane.at(p.x(), p.y()) : std::nullopt;
    if (!point) return {{}, false};
    extent.box.extend(Eigen::Vector2d(point->xyz.head<2>()));
  }
  const Eigen::Vector2d margin = 0.01 * extent.box.sizes();
  extent.box.min() -= margin;
  extent.box.max() += margin;
  return extent;
}

}  // namespace nadir::render

#include "grid_mapping.h"

#include <algorithm>
#include <cmath>

namespace nadir::mosaic {
namespace {

/// Corners of a unit square, where a patch is exact, and then the places where it is checked. Of the error of bilinear
/// interpolation, what second derivatives make is a s (1 - s) + b t (1 - t), whose length, convex in the two products,
/// peaks at the middle of the square or of an edge; what third ones make, odd about the middle, is 0 there along both
/// axes and peaks at 0.21, where the quarters see 97 % of it.
constexpr std::array<std::array<double, 2>, 13> places = {{{0, 0},
                                                           {1, 0},
                                                           {0, 1},
                                                           {1, 1},
                                                           {0.5, 0.5},
                                                           {0.5, 0},
                                                           {0, 0.5},
                                                           {1, 0.5},
                                                           {0.5, 1},
                                                           {0.25, 0.25},
                                                           {0.75, 0.25},
                                                           {0.25, 0.75},
                                                           {0.75, 0.75}}};

/// Share of the tolerance that a checked place may use. Along an axis both parts together pass what is seen by a factor
/// of 1.26 at most: q at the middle and 0.75 q + 0.97 c at a quarter are seen, of q + c.
constexpr double checked_share = 0.75;

/// Samples that make up a texel whose side is `length` texels of the source: as large a step as bilinear interpolation
/// takes without leaving out much of a texel.
int samples_along(double length) {
  constexpr double largest_step = 1.2;
  if (!(length > largest_step)) return 1;
  return static_cast<int>(std::min<double>(std::ceil(length - (largest_step - 1)), GridMapping::most_samples));
}

bool defined(const Eigen::Vector2d& p) { return std::isfinite(p.x()) && std::isfinite(p.y()); }

void choose_samples(Patch& patch) {
  patch.samples = {samples_along((patch.per_column + patch.rect.height / 2.0 * patch.twist).norm()),
                   samples_along((patch.per_row + patch.rect.width / 2.0 * patch.twist).norm())};
}

Patch through_corners(const Window& rect, const Eigen::Vector2d* corners) {
  const double w = rect.width, h = rect.height;
  Patch patch{rect, corners[0], (corners[1] - corners[0]) / w, (corners[2] - corners[0]) / h,
              (corners[3] - corners[2] - corners[1] + corners[0]) / (w * h)};
  choose_samples(patch);
  return patch;
}

}  // namespace

Window intersection(const Window& a, const Window& b) {
  const std::int64_t x0 = std::max(a.x, b.x), y0 = std::max(a.y, b.y);
  const std::int64_t x1 = std::min(std::int64_t{a.x} + a.width, std::int64_t{b.x} + b.width);
  const std::int64_t y1 = std::min(std::int64_t{a.y} + a.height, std::int64_t{b.y} + b.height);
  if (x1 <= x0 || y1 <= y0) return {};
  return {static_cast<std::int32_t>(x0), static_cast<std::int32_t>(y0), static_cast<std::int32_t>(x1 - x0),
          static_cast<std::int32_t>(y1 - y0)};
}

GridMapping::GridMapping(const Grid& target, const Grid& source, double tolerance_texels)
    : exact_(target, source),
      target_{0, 0, static_cast<std::int32_t>(target.width), static_cast<std::int32_t>(target.height)},
      source_(Eigen::Vector2d(0, 0),
              Eigen::Vector2d(static_cast<double>(source.width), static_cast<double>(source.height))),
      tolerance_texels_(tolerance_texels) {}

std::vector<Patch> GridMapping::patches(const Window& window) const {
  std::vector<Patch> patches;
  if (window.width <= 0 || window.height <= 0) return patches;
  if (const auto& affine = exact_.affine()) {
    Patch whole{target_, affine->translation(), affine->linear().col(0), affine->linear().col(1), {0, 0}};
    choose_samples(whole);
    patches.push_back(whole);
    return patches;
  }
  for (std::int32_t y = window.y / block_texels * block_texels; y < window.y + window.height; y += block_texels)
    for (std::int32_t x = window.x / block_texels * block_texels; x < window.x + window.width; x += block_texels)
      add(intersection({x, y, block_texels, block_texels}, target_), window, patches);
  return patches;
}

void GridMapping::add(const Window& rect, const Window& window, std::vector<Patch>& patches) const {
  if (intersection(rect, window).width == 0) return;
  std::array<Eigen::Vector2d, places.size()> points;
  const auto place = [&](std::size_t i) {
    return Eigen::Vector2d(rect.x + places[i][0] * rect.width, rect.y + places[i][1] * rect.height);
  };
  for (std::size_t i = 0; i < places.size(); ++i) points[i] = place(i);
  exact_.source_from_target(points);
  const auto undefined = points.size() - static_cast<std::size_t>(std::count_if(points.begin(), points.end(), defined));
  // A border of what is defined that enters between all of these points would have to turn within a patch.
  if (undefined == points.size()) return;

  if (undefined == 0) {
    const Patch patch = through_corners(rect, points.data());
    double worst = 0;
    Eigen::AlignedBox2d box;
    for (std::size_t i = 0; i < places.size(); ++i) {
      box.extend(points[i]);
      worst = std::max(worst, (patch.source(places[i][0] * rect.width, places[i][1] * rect.height) - points[i]).norm());
    }
    // Twice what is seen holds what is not, and a texel more the samples around a centre.
    const Eigen::Vector2d margin = Eigen::Vector2d::Constant(2 * worst + 1);
    if (!Eigen::AlignedBox2d(box.min() - margin, box.max() + margin).intersects(source_)) return;
    if (worst <= checked_share * tolerance_texels_) return patches.push_back(patch);
  }

  if (rect.width == 1 && rect.height == 1) {
    if (defined(points[4])) patches.push_back({rect, points[4], {0, 0}, {0, 0}, {0, 0}});
    return;
  }
  const std::int32_t left = (rect.width + 1) / 2, top = (rect.height + 1) / 2;
  for (const std::int32_t row : {0, 1})
    for (const std::int32_t column : {0, 1}) {
      const Window quarter{rect.x + column * left, rect.y + row * top, column ? rect.width - left : left,
                           row ? rect.height - top : top};
      if (quarter.width > 0 && quarter.height > 0) add(quarter, window, patches);
    }
}

}  // namespace nadir::mosaic

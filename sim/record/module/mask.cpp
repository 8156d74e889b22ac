#include "mask.h"

#include <algorithm>
#include <cmath>

namespace nadir::record {
namespace {

// Farther away, a double no longer places a point to a millionth of a pixel.
bool drawable(PicturePoint p) { return std::abs(p.x) <= 1e9 && std::abs(p.y) <= 1e9; }  // false for NaN

/// Pixels of `clip` within `margin_px` of the points.
Rectangle bounds(std::span<const PicturePoint> points, double margin_px, Rectangle clip) {
  double x0 = 1e9, y0 = 1e9, x1 = -1e9, y1 = -1e9;
  for (const PicturePoint p : points) {
    if (!drawable(p)) continue;
    x0 = std::min(x0, p.x), x1 = std::max(x1, p.x);
    y0 = std::min(y0, p.y), y1 = std::max(y1, p.y);
  }
  if (x0 > x1) return {clip.x, clip.y, 0, 0};
  const auto inside = [](double value, int from, int length) {
    return static_cast<int>(std::clamp(value, static_cast<double>(from), static_cast<double>(from + length)));
  };
  const int left = inside(std::floor(x0 - margin_px), clip.x, clip.width),
            right = inside(std::ceil(x1 + margin_px), clip.x, clip.width);
  const int top = inside(std::floor(y0 - margin_px), clip.y, clip.height),
            bottom = inside(std::ceil(y1 + margin_px), clip.y, clip.height);
  return {left, top, right - left, bottom - top};
}

double distance(PicturePoint p, PicturePoint a, PicturePoint b) {
  const double dx = b.x - a.x, dy = b.y - a.y, length2 = dx * dx + dy * dy;
  const double t = length2 > 0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / length2, 0.0, 1.0) : 0.0;
  return std::hypot(p.x - (a.x + t * dx), p.y - (a.y + t * dy));
}

void add_segment(Mask& mask, PicturePoint a, PicturePoint b, double width_px) {
  const double reach = width_px / 2 + 0.5;
  const PicturePoint ends[] = {a, b};
  const Rectangle box = bounds(ends, reach, mask.box);
  for (int y = box.y; y < box.y + box.height; ++y) {
    // The part of the segment that can reach this row bounds the columns to look at
    const double yc = y + 0.5, dy = b.y - a.y;
    double t0 = 0, t1 = 1;
    if (std::abs(dy) > 1e-9) {
      t0 = std::clamp((yc - reach - a.y) / dy, 0.0, 1.0), t1 = std::clamp((yc + reach - a.y) / dy, 0.0, 1.0);
    }
    const PicturePoint part[] = {{a.x + t0 * (b.x - a.x), yc}, {a.x + t1 * (b.x - a.x), yc}};
    const Rectangle columns = bounds(part, reach, box);
    float* row = mask.row(y);
    for (int x = columns.x; x < columns.x + columns.width; ++x) {
      const double covered = std::clamp(reach - distance({x + 0.5, yc}, a, b), 0.0, 1.0);
      float& pixel = row[x - mask.box.x];
      pixel = std::max(pixel, static_cast<float>(covered));
    }
  }
}

}  // namespace

Mask::Mask(Rectangle area)
    : box(area), coverage(static_cast<std::size_t>(area.width) * static_cast<std::size_t>(area.height), 0.0f) {}

Mask line(std::span<const PicturePoint> points, bool closed, double width_px, Rectangle clip) {
  Mask mask(bounds(points, width_px / 2 + 1, clip));
  if (mask.coverage.empty()) return mask;
  const auto segment = [&](PicturePoint a, PicturePoint b) {
    if (drawable(a) && drawable(b)) add_segment(mask, a, b, width_px);
  };
  for (std::size_t i = 1; i < points.size(); ++i) segment(points[i - 1], points[i]);
  if (closed || points.size() == 1) segment(points.back(), points.front());
  return mask;
}

Mask area(std::span<const PicturePoint> outline, Rectangle clip) {
  if (!std::all_of(outline.begin(), outline.end(), drawable)) return {};
  Mask mask(bounds(outline, 0, clip));
  if (mask.coverage.empty()) return mask;
  constexpr int lines_per_row = 4;
  const int left = mask.box.x, right = mask.box.x + mask.box.width;
  std::vector<double> crossings;
  for (int y = mask.box.y; y < mask.box.y + mask.box.height; ++y) {
    float* row = mask.row(y);
    for (int sub = 0; sub < lines_per_row; ++sub) {
      const double scan = y + (sub + 0.5) / lines_per_row;
      crossings.clear();
      for (std::size_t i = 0; i < outline.size(); ++i) {
        const PicturePoint a = outline[i], b = outline[(i + 1) % outline.size()];
        if ((a.y <= scan) != (b.y <= scan)) crossings.push_back(a.x + (scan - a.y) / (b.y - a.y) * (b.x - a.x));
      }
      std::sort(crossings.begin(), crossings.end());
      for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
        const double from = std::clamp<double>(crossings[i], left, right),
                     to = std::clamp<double>(crossings[i + 1], left, right);
        for (int x = static_cast<int>(from); x < to; ++x) {
          const double covered = std::min(to, x + 1.0) - std::max(from, static_cast<double>(x));
          row[x - left] += static_cast<float>(covered / lines_per_row);
        }
      }
    }
  }
  return mask;
}

Mask grown(const Mask& mask, double radius_px) {
  if (mask.coverage.empty()) return {};
  const int reach = static_cast<int>(std::ceil(radius_px));
  Mask out({mask.box.x - reach, mask.box.y - reach, mask.box.width + 2 * reach, mask.box.height + 2 * reach});
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const auto weight = static_cast<float>(std::clamp(radius_px + 1 - std::hypot(dx, dy), 0.0, 1.0));
      if (weight == 0) continue;
      for (int y = mask.box.y; y < mask.box.y + mask.box.height; ++y) {
        const float* from = mask.row(y);
        float* to = out.row(y + dy) + dx + reach;
        for (int x = 0; x < mask.box.width; ++x) to[x] = std::max(to[x], weight * from[x]);
      }
    }
  }
  return out;
}

}  // namespace nadir::record

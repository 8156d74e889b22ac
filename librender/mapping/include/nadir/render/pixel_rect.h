#pragma once

#include <algorithm>
#include <array>
#include <limits>

namespace nadir::render {

/// A rectangle of pixels, [x, x + width) by [y, y + height).
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;

  /// Cut across its longer side, so many pixels from its beginning.
  std::array<PixelRect, 2> cut_at(int pixels) const {
    PixelRect first = *this, second = *this;
    const bool wide = width >= height;
    (wide ? first.width : first.height) = pixels;
    (wide ? second.x : second.y) += pixels;
    (wide ? second.width : second.height) -= pixels;
    return {first, second};
  }
  std::array<PixelRect, 2> halves() const { return cut_at((width >= height ? width : height) / 2); }
  friend bool operator==(const PixelRect&, const PixelRect&) = default;
};

/// Rows of an image, [first, end); all of them by default.
struct RowRange {
  int first = 0, end = std::numeric_limits<int>::max();

  /// How many of its rows a rectangle has.
  int shared(const PixelRect& rect) const {
    return std::max(0, std::min(rect.y + rect.height, end) - std::max(rect.y, first));
  }
  bool meets(const PixelRect& rect) const { return shared(rect) > 0; }
};

}  // namespace nadir::render

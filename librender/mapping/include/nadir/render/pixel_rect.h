#pragma once

#include <array>

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
};

}  // namespace nadir::render

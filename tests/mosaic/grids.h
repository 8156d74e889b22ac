#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "nadir/mosaic/placement.h"

namespace nadir::mosaic {

/// A north-up grid: its upper left corner in units of `crs`, and the side of its texels.
Grid north_up(const std::string& crs, double left, double top, double side, std::int64_t width, std::int64_t height);

/// A grid of `width` x `height` texels of `side` whose middle lies at a place.
Grid around(const std::string& crs, double lon_deg, double lat_deg, double side, std::int64_t width,
            std::int64_t height);

/// CRS to CRS by the projection library alone, in place; NaN where it has no answer. Geographic x first.
void transform_by_library(const std::string& from, const std::string& to, std::vector<Eigen::Vector2d>& points);

/// A block of `window` with band `b` of texel (x, y) = f(x, y, b), and all of it valid.
template <class T>
Block block_of(const TexelType& type, const Window& window, const std::function<T(int, int, int)>& f) {
  Block block(type, window);
  for (int y = window.y; y < window.y + window.height; ++y) {
    T* row = reinterpret_cast<T*>(block.row(y));
    for (int x = window.x; x < window.x + window.width; ++x) {
      for (int b = 0; b < type.bands; ++b) *row++ = f(x, y, b);
      if (block.masked()) block.valid_row(y)[x - window.x] = 255;
    }
  }
  return block;
}

/// Sample of a block.
template <class T>
T& at(Block& block, int x, int y, int band = 0) {
  const auto bands = static_cast<int>(block.texel_bytes() / sizeof(T));
  return reinterpret_cast<T*>(block.row(y))[(x - block.window().x) * bands + band];
}

inline Window whole(const Grid& grid) {
  return {0, 0, static_cast<std::int32_t>(grid.width), static_cast<std::int32_t>(grid.height)};
}

}  // namespace nadir::mosaic

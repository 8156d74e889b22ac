#include "canvas.h"

#include <algorithm>
#include <cmath>

namespace nadir::record {

static_assert(sizeof(Colour) == 3, "a row of colours is a row of interleaved samples");

Colour mix(Colour a, Colour b, double t) {
  const auto channel = [t](std::uint8_t from, std::uint8_t to) {
    return static_cast<std::uint8_t>(std::lround(from + t * (to - from)));
  };
  return {channel(a.r, b.r), channel(a.g, b.g), channel(a.b, b.b)};
}

Canvas::Canvas(int width, int height, Colour ground)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), ground) {}

void Canvas::blend(int x, int y, Colour colour, double opacity) {
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
  Colour& pixel = pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  pixel = mix(pixel, colour, std::clamp(opacity, 0.0, 1.0));
}

void Canvas::paint(const Mask& mask, Colour colour, double opacity) {
  for (int y = mask.box.y; y < mask.box.y + mask.box.height; ++y) {
    const float* row = mask.row(y);
    for (int x = 0; x < mask.box.width; ++x) {
      if (row[x] > 0) blend(mask.box.x + x, y, colour, opacity * static_cast<double>(row[x]));
    }
  }
}

void Canvas::fill(Rectangle area, Colour colour) {
  for (int y = area.y; y < area.y + area.height; ++y) {
    for (int x = area.x; x < area.x + area.width; ++x) blend(x, y, colour, 1);
  }
}

}  // namespace nadir::record

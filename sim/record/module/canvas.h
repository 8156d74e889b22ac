#pragma once

#include <cstdint>
#include <vector>

#include "mask.h"

namespace nadir::record {

struct Colour {
  std::uint8_t r = 0, g = 0, b = 0;
};

/// From `a` at t = 0 to `b` at t = 1.
Colour mix(Colour a, Colour b, double t);

/// A picture being painted: opaque, 8 bits a channel. What falls outside is left out.
class Canvas {
 public:
  Canvas(int width, int height, Colour ground);

  Rectangle box() const { return {0, 0, width_, height_}; }
  ImageView view() const { return {pixels_.data(), tile::SampleType::UInt8, width_, height_, 3}; }

  /// Blends `colour` in where `mask` covers, at most by `opacity`.
  void paint(const Mask& mask, Colour colour, double opacity = 1);
  void fill(Rectangle area, Colour colour);
  void blend(int x, int y, Colour colour, double opacity);

 private:
  int width_, height_;
  std::vector<Colour> pixels_;
};

}  // namespace nadir::record

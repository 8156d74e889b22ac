#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "known_content.h"
#include "nadir/bench/procedural_tiff.h"
#include "view.h"

namespace nadir::bench {

/// What a map holds: the scene, and the texels that were made of it.
struct MapContent {
  KnownContent scene;
  std::vector<float> texels;  // of level 0, repeated in both directions
  SampleType type = SampleType::u8;

  static MapContent make(int side, int bands, SampleType type);
  double peak() const { return type == SampleType::u8 ? 255 : type == SampleType::u16 ? 65535 : 1; }
};

/// What some pixels of a view ought to show, bands interleaved.
struct Ideal {
  int width = 0, bands = 0;  // of the whole frame
  std::vector<std::size_t> pixels;
  std::vector<double> scene;  // mean of the scene under the pixel
  std::vector<double> image;  // mean of the bilinear map under the pixel, in the type's values: the `reference` filter,
                              // written anew from its definition
};

/// Pixels of a view by a lattice just fine enough that all take at most `budget` samples of the map.
std::vector<std::size_t> lattice(const View& view, double budget);
/// Pixels of a rectangle, rows from the top.
std::vector<std::size_t> rectangle(const View& view, int x, int y, int width, int height);

/// Each pixel is integrated as an exact perspective square: the scene by its closed form for the parallelogram that the
/// square comes to at its middle, the map by at least 8 x 8 samples and two a texel.
Ideal ideal_of(const View& view, const MapContent& map, std::vector<std::size_t> pixels);

struct Deviation {
  double rms = 0, max = 0;
  /// Infinite where nothing deviates.
  double psnr(double peak) const;
};

/// Of a frame's samples, at the ideal's pixels, from its scene or its image.
Deviation deviation(std::span<const std::byte> frame, SampleType type, const Ideal& ideal,
                    const std::vector<double>& values);

/// A sample of a frame as a number.
double sample_at(std::span<const std::byte> frame, SampleType type, std::size_t i);

}  // namespace nadir::bench

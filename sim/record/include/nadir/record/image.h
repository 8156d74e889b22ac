#pragma once

#include <cstddef>
#include <vector>

#include "nadir/tile/sample_type.h"

namespace nadir::record {

/// Someone else's pixels: rows from the top, samples interleaved, no padding. All sizes > 0.
struct ImageView {
  const void* samples = nullptr;
  tile::SampleType type = tile::SampleType::UInt8;
  int width = 0;
  int height = 0;
  int channels = 0;

  std::size_t pixel_count() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  std::size_t size_bytes() const { return pixel_count() * static_cast<std::size_t>(channels) * tile::size_bytes(type); }
};

/// Pixels of its own, laid out as in ImageView.
struct Image {
  std::vector<std::byte> samples;
  tile::SampleType type = tile::SampleType::UInt8;
  int width = 0;
  int height = 0;
  int channels = 0;

  ImageView view() const { return {samples.data(), type, width, height, channels}; }
};

}  // namespace nadir::record

#pragma once

#include <cstddef>
#include <optional>

#include "nadir/tile/sample_type.h"

namespace nadir::render {

/// The type that a sensor delivers, and the range of map values that its scale spans.
struct Output {
  tile::SampleType type = tile::SampleType::UInt8;
  double low = 0,
         high = 255;  // map values that become the type's lowest and highest; for Float32 values stay as they are
};

/// The whole range of uint8 and uint16 maps, which frames of the same type keep.
std::optional<Output> natural_output(tile::SampleType type);

/// `count` samples of type `from` as `output.type`: linear from [low, high] to the type's full range (of int16: 0 to
/// 32767), rounded to nearest, clamped. `converted`: has room for them.
void convert(const void* samples, tile::SampleType from, std::size_t count, const Output& output, void* converted);

}  // namespace nadir::render

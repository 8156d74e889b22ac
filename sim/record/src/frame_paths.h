#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "nadir/render/frame.h"

namespace nadir::record {

/// Where a frame's files lie in the dataset, without their endings.
inline std::string stem_of(const std::string& vehicle, const std::string& sensor, std::int64_t time_ns) {
  return fmt::format("frames/{}/{}/{:015}", vehicle, sensor, time_ns);
}

/// The ending of a layer's image.
inline std::string image_ending(const render::FrameLayer& layer) {
  const bool png =
      (layer.type == tile::SampleType::UInt8 || layer.type == tile::SampleType::UInt16) && layer.bands <= 4;
  return png ? ".png" : ".tif";
}

}  // namespace nadir::record

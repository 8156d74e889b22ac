#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "grid_mapping.h"
#include "nadir/mosaic/placement.h"

namespace nadir::mosaic {

/// How texels of a source become texels of a target.
struct Resampling {
  TexelType type;
  PlacementOptions options;
  std::int32_t source_width = 0, source_height = 0;  // of the whole raster
};

/// Texels of the source beyond those around a place that an interpolation may ask for.
inline std::int32_t reach(Interpolation interpolation) { return interpolation == Interpolation::Cubic ? 2 : 1; }

/// Lays `source` onto the texels of `target` within `clip` and `patches`, as Placement::resample does.
void resample(const Resampling& resampling, std::span<const Patch> patches, const Window& clip, const Block& source,
              Block& target);

/// Lays `source` onto the texels of `target` within `clip`; its texel (0, 0) lies at `shift`.
void copy(const TexelType& type, std::array<std::int64_t, 2> shift, const Window& clip, const Block& source,
          Block& target);

}  // namespace nadir::mosaic

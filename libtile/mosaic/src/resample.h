#pragma once

#include "grid_mapping.h"
#include "nadir/mosaic/placement.h"

namespace nadir::mosaic {

/// How far around a source coordinate, in texels, samples are looked at.
double reach(const PlacementOptions& options, double minification);

/// Lays texels of `source` over those of `target`, as Placement::resample says.
/// `source_width`, `source_height`: of the whole raster, whose outline is the border of what it covers.
class Resampler {
 public:
  Resampler(const TexelType& type, const PlacementOptions& options, double minification, std::int64_t source_width,
            std::int64_t source_height)
      : type_(type), options_(options), minification_(minification), width_(source_width), height_(source_height) {}

  /// Within `window` of the target and `patches`.
  void resample(std::span<const MappingPatch> patches, const Window& window, const Block& source, Block& target) const;

 private:
  const TexelType& type_;
  const PlacementOptions& options_;
  double minification_;
  std::int64_t width_, height_;
};

}  // namespace nadir::mosaic

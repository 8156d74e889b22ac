#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "nadir/base/result.h"
#include "nadir/mosaic/block.h"
#include "nadir/mosaic/grid.h"

namespace nadir::mosaic {

/// How samples between texels are found.
enum class Interpolation : std::uint8_t { Nearest, Bilinear, Cubic };

struct PlacementOptions {
  Interpolation interpolation = Interpolation::Bilinear;
  double tolerance_texels = 0.05;  // greatest distance from the exact mapping, in texels of the source
  bool power = false;              // samples are decibels: blended as the power they stand for
  double scale = 1, offset = 0;    // decibels = sample * scale + offset
};

/// Lays a raster onto the grid of a map.
///
/// Where both grids differ by whole texels only, it is a shift and texels are copied. Else the mapping from target to
/// source texels is exact (affine; or through WGS-84 longitude and latitude) at the corners of patches, which are
/// halved until bilinear interpolation inside meets the tolerance where its error peaks; where the target's texels are
/// larger than the source's, several samples along the footprint are averaged.
/// Thread-safe.
class Placement {
 public:
  /// Unsupported where no texel of the source is defined in the target's CRS.
  static Result<Placement> create(const Grid& target, const Grid& source, const PlacementOptions& options);

  /// The target's texel at which the source's first lies, where texels are copied.
  std::optional<std::array<std::int64_t, 2>> shift() const;

  /// Side of a target texel in texels of the source: the greater singular value at the source's centre.
  double minification() const;

  /// Smallest window of the target that holds all that the source covers; clipped to the target; empty (width 0) where
  /// they do not meet.
  Window covered() const;

  /// Texels of the source that the window `target` needs; clipped to the source; width 0 where it needs none.
  Window needed(const Window& target) const;

  /// Adds the source to `target`, which holds what lies below: texels of it replace those where they hold data (not
  /// nodata, masked, transparent or NaN), all others stay. `source`: at least needed(target.window()).
  /// Within half a texel of the source's outline they replace none that hold data.
  /// Colours under partial transparency are weighted by it; nodata and invalid texels have no part in what is blended.
  void resample(const TexelType& type, const Block& source, Block& target) const;

  /// Points that went through the exact mapping so far.
  std::int64_t exact_points() const;

 private:
  struct State;
  explicit Placement(std::shared_ptr<const State> state) : state_(std::move(state)) {}
  std::shared_ptr<const State> state_;
};

}  // namespace nadir::mosaic

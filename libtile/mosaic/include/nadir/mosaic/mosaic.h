#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/mosaic/block.h"
#include "nadir/mosaic/grid.h"
#include "nadir/mosaic/placement.h"
#include "nadir/mosaic/source.h"

namespace nadir::mosaic {

struct MosaicOptions {
  GridOptions grid;
  PlacementOptions placement;
};

/// How one source comes to lie in the mosaic.
struct Layer {
  std::shared_ptr<const Source> source;
  std::optional<Placement> placement;  // empty for the only source of a mosaic without a grid: it is the mosaic
  Window covered;                      // texels of the mosaic that it reaches; width 0: none
};

/// Many rasters laid onto one grid, later ones on top: level 0 of a map, made a window at a time.
/// Thread-safe.
class Mosaic {
 public:
  /// A mask is added where the sources leave gaps and nothing else says what is missing.
  /// Malformed where a source has no georeference; one alone may have ground control points instead, and then there is
  /// no grid.
  static Result<Mosaic> lay_out(Sources sources, const MosaicOptions& options);

  std::int32_t width() const { return width_; }
  std::int32_t height() const { return height_; }
  const TexelType& type() const { return type_; }
  const std::optional<Grid>& grid() const { return grid_; }
  const std::vector<Layer>& layers() const { return layers_; }  // bottom first
  const Sources& sources() const { return sources_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

  /// Reads layer `i` from `source` from now on, which holds the same texels.
  void replace_source(std::size_t i, std::shared_ptr<const Source> source) { layers_[i].source = std::move(source); }

  /// Whether any source reaches into `window`.
  bool reaches(const Window& window) const;

  /// Fills `to`, whose window lies within the mosaic; what no source holds data for is empty.
  Result<void> read(Block& to) const;

 private:
  Mosaic() = default;
  Result<void> lay_onto_grid(const MosaicOptions& options);
  bool is_covered() const;  // every texel, by some source

  Sources sources_;
  std::int32_t width_ = 0, height_ = 0;
  TexelType type_;
  std::optional<Grid> grid_;
  std::vector<Layer> layers_;
  std::vector<std::string> warnings_;
};

}  // namespace nadir::mosaic

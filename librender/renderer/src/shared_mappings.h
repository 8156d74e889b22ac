#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "nadir/render/patches.h"
#include "nadir/render/scene.h"

namespace nadir::render {

/// One mapping for all layers of a CRS, of those that take part.
struct SharedMappings {
  std::vector<PatchMapping> mappings;
  std::vector<std::size_t> index;  // of each layer's

  const PatchMapping& of(std::size_t layer) const { return mappings[index[layer]]; }
  /// Whether no layer before shares it.
  bool is_first(std::size_t layer) const;
};

/// Of the layers whose indices are `which`, in their order. `rows`: as map_patches has it.
SharedMappings share_mappings(const Scene& scene, const ExactChain& chain, double tolerance_px,
                              std::span<const std::size_t> which, const RowRange& rows = {});

}  // namespace nadir::render

#include "shared_mappings.h"

#include <algorithm>

namespace nadir::render {

bool SharedMappings::is_first(std::size_t layer) const {
  const auto own = index.begin() + static_cast<std::ptrdiff_t>(layer);
  return std::find(index.begin(), own, *own) == own;
}

SharedMappings share_mappings(const Scene& scene, const ExactChain& chain, double tolerance_px,
                              std::span<const std::size_t> which, const RowRange& rows) {
  SharedMappings shared;
  const auto projection_of = [&](std::size_t i) -> const geodesy::Projection& {
    return scene.layers()[which[i]].source->map().projection();
  };
  for (std::size_t i = 0; i < which.size(); ++i) {
    std::vector<GroundExtent> extents;
    std::size_t first = i;
    for (std::size_t k = 0; k < which.size(); ++k) {
      if (!(projection_of(k) == projection_of(i))) continue;
      first = std::min(first, k);
      extents.push_back(scene.layers()[which[k]].extent);
    }
    if (first < i) {
      shared.index.push_back(shared.index[first]);
      continue;
    }
    shared.index.push_back(shared.mappings.size());
    shared.mappings.push_back(map_patches(chain, projection_of(i), tolerance_px, extents, rows));
  }
  return shared;
}

}  // namespace nadir::render

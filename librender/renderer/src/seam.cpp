#include "seam.h"

#include <cstring>

namespace nadir::render {

void copy_run(const SeamRun& run, const tile::Cell& stored, tile::Cell& cell) {
  using tile::cell_size, tile::cell_apron, tile::cell_stride;
  const std::size_t texel = static_cast<std::size_t>(stored.bands()) * tile::size_bytes(stored.type());
  for (int row = 0; row < cell_stride; ++row) {
    // Apron rows may be missing, and are not sampled then
    if (row < cell_apron && !stored.has({0, -1})) continue;
    if (row >= cell_apron + cell_size && !stored.has({0, 1})) continue;
    const auto first = static_cast<std::size_t>(row) * cell_stride;
    const std::size_t to = first + static_cast<std::size_t>(run.to), from = first + static_cast<std::size_t>(run.from);
    const auto count = static_cast<std::size_t>(run.count);
    std::memcpy(cell.samples() + to * texel, stored.data<std::byte>() + from * texel, count * texel);
    if (stored.masked()) std::memcpy(cell.writable_validity() + to, stored.validity() + from, count);
  }
}

}  // namespace nadir::render

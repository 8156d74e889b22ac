#pragma once

#include <algorithm>
#include <cstdint>

#include "nadir/tile/cell_source.h"

namespace nadir::render {

/// Consecutive columns of a cell that is counted on around the Earth, and the stored cell that holds them.
struct SeamRun {
  int to = 0;  // first of them, apron included
  int count = 0;
  std::int32_t col = 0;  // of the stored cell
  int from = 0;          // first of them there, apron included
};

/// The runs that make column `col` of cells, apron included, of a level of `around` texels in a turn.
template <class Visit>
void for_each_seam_run(std::int32_t col, std::int32_t around, Visit&& visit) {
  using tile::cell_size, tile::cell_apron, tile::cell_stride;
  for (int to = 0; to < cell_stride;) {
    const std::int64_t texel = static_cast<std::int64_t>(col) * cell_size + to - cell_apron + around;
    const auto stored = static_cast<std::int32_t>(texel % around);
    const std::int32_t end = std::min(around, (stored / cell_size + 1) * cell_size);
    const int count = std::min(end - stored, cell_stride - to);
    visit(SeamRun{to, count, stored / cell_size, stored % cell_size + cell_apron});
    to += count;
  }
}

/// Copies a run of a stored cell, all of its rows that are there, into one that is counted on. Texels come as they are:
/// what lies across the seam is a neighbour like any other.
void copy_run(const SeamRun& run, const tile::Cell& stored, tile::Cell& cell);

}  // namespace nadir::render

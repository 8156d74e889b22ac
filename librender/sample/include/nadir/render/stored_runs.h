#pragma once

#include <algorithm>
#include <cstdint>

#include "nadir/tile/cell.h"

namespace nadir::render {

/// Consecutive columns of a level that one stored cell holds.
struct StoredRun {
  int to = 0, count = 0;   // first of them as counted from where the walk began, and how many
  std::int32_t first = 0;  // stored column of the first
};

/// The runs that make `count` columns from `first` on of a level of `width`. Where the level goes `around` the Earth,
/// columns are counted on past its ends; elsewhere the columns at its ends are repeated.
template <class Visit>
void for_each_stored_run(std::int64_t first, int count, std::int32_t width, bool around, Visit&& visit) {
  for (int to = 0; to < count;) {
    const std::int64_t counted = first + to;
    const std::int64_t turned = (counted % width + width) % width;
    const auto stored = static_cast<std::int32_t>(around ? turned : std::clamp<std::int64_t>(counted, 0, width - 1));
    int run = 1;  // repeated columns one by one: they are few
    if (around || counted == stored) {
      const std::int64_t cell_end = (std::int64_t{stored} / tile::cell_size + 1) * tile::cell_size;  // may be 2^31
      run = std::min(static_cast<int>(std::min<std::int64_t>(cell_end, width) - stored), count - to);
    }
    visit(StoredRun{to, run, stored});
    to += run;
  }
}

}  // namespace nadir::render

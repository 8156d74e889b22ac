#pragma once

#include <cstdint>

#include "nadir/render/layer_plan.h"

namespace nadir::render {

/// Whether blocks of a map may be counted on across its ends: it goes around the Earth, and turns of it can be counted.
bool counts_turns(const tile::Map& map);

/// Finds the cells of the levels that a block's pixels sample: those at its corners, over what it sees, which
/// meets the map. Where they lie across the two ends of a map that goes around the Earth, the block's texels are
/// counted on from the third turn. Returns how many cells, at most.
std::int64_t find_windows(PlannedBlock& block, const tile::Map& map);

}  // namespace nadir::render

#pragma once

#include <optional>

#include "nadir/render/expected_error.h"
#include "nadir/render/layer_plan.h"

namespace nadir::render {

/// Root mean square error to expect of a planned layer's pixels against the reference filter, in map values, their
/// rounding included. Empty where the map does not tell what its levels lose, and of values in decibel.
/// Cost: a few microseconds a block, once its footprint is known to `model`.
std::optional<double> expected_rmse(const LayerPlan& plan, const tile::CellSource& source, ErrorModel& model);

}  // namespace nadir::render

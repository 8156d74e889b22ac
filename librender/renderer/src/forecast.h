#pragma once

#include <optional>
#include <vector>

#include "nadir/render/expected_error.h"
#include "nadir/render/layer_plan.h"

namespace nadir::render {

/// Gathers what is planned of a layer, and predicts the error of its pixels.
class Forecast {
 public:
  /// Those blocks of a plan that begin in `rows`: of a frame in bands each block is added once.
  void add(const LayerPlan& plan, const RowRange& rows = {});

  /// Root mean square error to expect of the pixels against the reference filter, in map values, their rounding
  /// included. Empty where the map does not tell what its levels lose. Not for values in decibel. The same in whatever
  /// order plans were added.
  /// Cost: a few microseconds a block, once its footprint is known to `model`.
  std::optional<double> expected_rmse(const tile::CellSource& source, ErrorModel& model);

  struct View {
    SampledFootprint footprint;
    Eigen::AlignedBox2d texels;  // of level 0
    int octave = 0;              // of the footprint
    PixelRect rect;
  };

 private:
  std::vector<View> views_;
};

}  // namespace nadir::render

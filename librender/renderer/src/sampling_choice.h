#pragma once

#include <optional>

#include "forecast.h"
#include "nadir/render/layer_plan.h"
#include "nadir/render/renderer.h"
#include "nadir/render/scene.h"

namespace nadir::render {

/// What the options ask for, but for `max_error`.
Sampling sampling_of(const Layer& layer, const RenderOptions& options);

struct SampledPlan {
  Sampling sampling;
  LayerPlan plan;
  std::optional<double> expected_rmse;
};

/// As the options ask, `max_error` among them, which fails where no error can be predicted.
Result<SampledPlan> plan_sampling(const Layer& layer, const PatchMapping& mapping, const RenderOptions& options,
                                  ErrorModel& model);

}  // namespace nadir::render

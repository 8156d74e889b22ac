#pragma once

#include <functional>
#include <optional>

#include "forecast.h"
#include "nadir/render/layer_plan.h"
#include "nadir/render/renderer.h"
#include "nadir/render/scene.h"

namespace nadir::render {

/// What the options ask for, but for `max_error`.
Sampling sampling_of(const Layer& layer, const RenderOptions& options);

/// Whether a layer sampled so has an error to be predicted: that of an approximation of the reference, in no decibels.
bool is_predicted(const Layer& layer, const Sampling& sampling);

/// Truth::expected_rmse of a layer: of what is forecast, in the frame's values.
std::optional<double> expected_error(const Layer& layer, Forecast& forecast, ErrorModel& model);

struct SampledPlan {
  Sampling sampling;
  LayerPlan plan;
  std::optional<double> expected_rmse;
  bool sees_map = false;
};

/// As the options ask, `max_error` among them, which fails where no error can be predicted: of the plans that `planned`
/// makes, the last one it is asked for.
Result<SampledPlan> choose_plan(const Layer& layer, const RenderOptions& options,
                                const std::function<SampledPlan(const Sampling&)>& planned);

/// Likewise, of a mapping of the whole image.
Result<SampledPlan> plan_sampling(const Layer& layer, const PatchMapping& mapping, const RenderOptions& options,
                                  ErrorModel& model);

}  // namespace nadir::render

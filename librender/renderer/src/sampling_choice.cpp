#include "sampling_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "nadir/render/quality_ladder.h"

namespace nadir::render {
namespace {

/// How much of the frame's values one of the map's is.
double output_scale(const Layer& layer) {
  const auto& output = layer.options.output;
  if (!output || output->type == tile::SampleType::Float32) return 1;
  return tile::with_sample_type(output->type, [&]<class T>(T) {
    return static_cast<double>(std::numeric_limits<T>::max()) / (output->high - output->low);
  });
}

}  // namespace

Sampling sampling_of(const Layer& layer, const RenderOptions& options) {
  Sampling sampling = sampling_for(options.quality);
  if (options.filter) sampling.filter = *options.filter;
  if (options.oversampling) sampling.oversampling = *options.oversampling;
  if (options.level_blend) sampling.level_blend = *options.level_blend;
  if (layer.options.role == tile::Role::Labels) sampling.filter = Filter::Nearest;
  if (sampling.filter == Filter::Reference)
    sampling.oversampling = std::max(least_reference_oversampling, options.oversampling.value_or(0));
  return sampling;
}

bool is_predicted(const Layer& layer, const Sampling& sampling) {
  return sampling.filter != Filter::Nearest && sampling.filter != Filter::Reference &&
         layer.source->domain() != tile::Domain::Decibel;
}

std::optional<double> expected_error(const Layer& layer, Forecast& forecast, ErrorModel& model) {
  const auto rmse = forecast.expected_rmse(*layer.source, model);
  return rmse ? std::optional(*rmse * output_scale(layer)) : std::nullopt;
}

Result<SampledPlan> choose_plan(const Layer& layer, const RenderOptions& options,
                                const std::function<SampledPlan(const Sampling&)>& planned) {
  if (!options.max_error || layer.options.role == tile::Role::Labels) return planned(sampling_of(layer, options));
  SampledPlan chosen;
  for (const Rung& rung : quality_ladder()) {
    chosen = planned(sampling_of(layer, with_rung({}, rung)));
    if (!chosen.sees_map) break;
    if (!chosen.expected_rmse)
      return fail(Error::Kind::Unsupported,
                  fmt::format("layer {}: no error can be predicted for {}, {}: choose a quality instead", layer.name,
                              layer.source->map().description().path,
                              layer.source->domain() == tile::Domain::Decibel
                                  ? "whose values are decibels"
                                  : "which does not tell what its levels lose (a map made by nadir build does)"));
    if (*chosen.expected_rmse <= *options.max_error) break;
  }
  return chosen;
}

Result<SampledPlan> plan_sampling(const Layer& layer, const PatchMapping& mapping, const RenderOptions& options,
                                  ErrorModel& model) {
  const auto planned = [&](const Sampling& sampling) {
    SampledPlan p{sampling, plan_layer(mapping, *layer.source, sampling), std::nullopt};
    p.sees_map = !p.plan.blocks.empty();
    Forecast forecast;
    if (is_predicted(layer, sampling)) forecast.add(p.plan);
    p.expected_rmse = expected_error(layer, forecast, model);
    return p;
  };
  return choose_plan(layer, options, std::ref(planned));
}

}  // namespace nadir::render

#include "sampling_choice.h"

#include <fmt/format.h>

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
  return sampling;
}

Result<SampledPlan> plan_sampling(const Layer& layer, const PatchMapping& mapping, const RenderOptions& options,
                                  ErrorModel& model) {
  const auto planned = [&](const Sampling& sampling) {
    SampledPlan p{sampling, plan_layer(mapping, *layer.source, sampling), std::nullopt};
    const bool approximates = sampling.filter != Filter::Nearest && sampling.filter != Filter::Reference;
    if (const auto rmse = approximates ? expected_rmse(p.plan, *layer.source, model) : std::nullopt)
      p.expected_rmse = *rmse * output_scale(layer);
    return p;
  };
  if (!options.max_error || layer.options.role == tile::Role::Labels) return planned(sampling_of(layer, options));
  SampledPlan chosen;
  for (const Rung& rung : quality_ladder()) {
    chosen = planned(sampling_of(layer, with_rung({}, rung)));
    if (chosen.plan.blocks.empty()) break;  // sees none of the map
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

}  // namespace nadir::render

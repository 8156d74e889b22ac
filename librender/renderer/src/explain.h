#pragma once

#include "nadir/render/explanation.h"
#include "nadir/render/layer_plan.h"
#include "nadir/render/scene.h"

namespace nadir::render {

/// What is known of a layer once it is planned. `truth`: with what the plan has put there.
LayerExplanation explain_layer(const Layer& layer, const PatchMapping& mapping, bool mapping_shared,
                               const LayerPlan& plan, const Truth& truth);

/// What all layers share.
void finish_explanation(const Scene& scene, const Camera& camera, const FrameCounters& counters,
                        Explanation& explanation);

}  // namespace nadir::render

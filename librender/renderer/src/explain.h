#pragma once

#include "nadir/render/frame.h"
#include "nadir/render/layer_plan.h"
#include "nadir/render/scene.h"

namespace nadir::render {

/// Says what a frame's layer took and what it did without.
void explain_layer(const Layer& layer, const PatchMapping& mapping, bool mapping_shared, const LayerPlan& plan,
                   const FrameLayer& frame, Explanation& explanation);

/// Says the same of what all layers share.
void explain_frame(const Scene& scene, const Camera& camera, const FrameCounters& counters, Explanation& explanation);

}  // namespace nadir::render

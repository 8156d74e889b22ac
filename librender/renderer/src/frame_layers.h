#pragma once

#include "nadir/render/frame.h"
#include "nadir/render/renderer.h"
#include "sampling_choice.h"

namespace nadir::render {

/// A layer of the frame with its geometric truth, but no pixels yet.
FrameLayer empty_layer(const Layer& layer, const ExactChain& chain);

/// Gives it the pixels of `rows` rows, invalid so far, of map values.
void allocate(const Layer& layer, int rows, FrameLayer& out);

void clear(FrameLayer& layer);

/// Notes how a layer is sampled. Of the instants of an exposure, the widest range of levels, and the most of all else.
/// `cells`: that it is sampled from.
void note_plan(const SampledPlan& planned, double geometry_error_px, std::int64_t cells, const RenderOptions& options,
               bool first, Truth& truth);

/// From map values to what the sensor delivers. Returns how many pixels are valid.
std::int64_t finish_layer(const Layer& layer, const RenderOptions& options, FrameLayer& out);

/// What all maps of a scene have cost so far, each counted once however many layers it has.
struct WorkTotals {
  std::int64_t projection_points = 0, windows_read = 0, samples_read = 0;
};
WorkTotals totals(const Scene& scene);

}  // namespace nadir::render

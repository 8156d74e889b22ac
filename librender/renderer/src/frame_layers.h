#pragma once

#include <set>
#include <string>
#include <vector>

#include "nadir/render/frame.h"
#include "nadir/render/renderer.h"
#include "sampling_choice.h"

namespace nadir::render {

/// A layer of the frame with its geometric truth, but no pixels yet; they will take their memory from `memory`.
FrameLayer empty_layer(const Layer& layer, const ExactChain& chain, const std::shared_ptr<FrameMemory>& memory);

/// Gives it the pixels of `rows` rows, of map values. They hold anything, be they valid or not.
void allocate(const Layer& layer, int rows, FrameLayer& out);

/// Has all pixels invalid that `plan` does not sample.
void prepare(const LayerPlan& plan, FrameLayer& out);

/// Layers by how an exposure shows them, as indices.
struct LayerKinds {
  std::vector<std::size_t> all, blended, labels;  // labels are those of the exposure's middle
};
LayerKinds kinds_of(const Scene& scene);

/// Notes how a layer is sampled. Of the instants of an exposure, the widest range of levels, and the most of all else.
/// `cells`: that it is sampled from.
void note_plan(const SampledPlan& planned, double geometry_error_px, std::int64_t cells, const RenderOptions& options,
               bool first, Truth& truth);

/// From map values to what the sensor delivers: its output type, and what invalid pixels hold, of which samples may
/// hold anything before. Returns how many are valid. In parallel.
std::int64_t finish_layer(const Layer& layer, const RenderOptions& options, FrameLayer& out);

/// What was found of damaged tiles of the layer's map.
void note_damage(const std::set<std::string>& damage, Truth& truth);

/// What all maps of a scene, each counted once however many layers it has, and the cache have cost so far.
struct WorkTotals {
  std::int64_t projection_points = 0, windows_read = 0, samples_read = 0, cells_loaded = 0;
};
WorkTotals work_so_far(const Scene& scene, const tile::CellCache& cache);
void count_work(const WorkTotals& before, const WorkTotals& after, FrameCounters& counters);

}  // namespace nadir::render

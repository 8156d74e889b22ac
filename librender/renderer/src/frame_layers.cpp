#include "frame_layers.h"

#include <algorithm>

namespace nadir::render {

FrameLayer empty_layer(const Layer& layer, const ExactChain& chain, const std::shared_ptr<FrameMemory>& memory) {
  FrameLayer out;
  out.samples = FrameBuffer<std::byte>(FrameAllocator<std::byte>(memory));
  out.validity = FrameBuffer<std::uint8_t>(FrameAllocator<std::uint8_t>(memory));
  out.name = layer.name;
  out.width = chain.camera().width_px();
  out.height = chain.camera().height_px();
  out.bands = static_cast<int>(layer.source->bands().size());
  out.type = layer.source->type();
  out.truth = geometric_truth(chain, layer.source->map());
  return out;
}

void allocate(const Layer& layer, int rows, FrameLayer& out) {
  const std::size_t pixels = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(rows);
  out.height = rows;
  out.type = layer.source->type();
  out.samples.clear();  // a band's values are not worth copying to where the next one has room
  out.samples.resize(pixels * static_cast<std::size_t>(out.bands) * tile::size_bytes(out.type));
  out.validity.resize(pixels);
}

void prepare(const LayerPlan& plan, FrameLayer& out) {
  if (plan.pixels_sampled < static_cast<std::int64_t>(out.validity.size()))
    std::fill(out.validity.begin(), out.validity.end(), std::uint8_t{0});
}

LayerKinds kinds_of(const Scene& scene) {
  LayerKinds kinds;
  for (const Layer& layer : scene.layers()) {
    (layer.options.role == tile::Role::Labels ? kinds.labels : kinds.blended).push_back(kinds.all.size());
    kinds.all.push_back(kinds.all.size());
  }
  return kinds;
}

void note_plan(const SampledPlan& planned, double geometry_error_px, std::int64_t cells, const RenderOptions& options,
               bool first, Truth& truth) {
  const LayerPlan& plan = planned.plan;
  truth.quality = options.quality;
  truth.filter = planned.sampling.filter;
  truth.oversampling = planned.sampling.oversampling;
  truth.adaptive = options.adaptive;
  truth.finest_level = first ? plan.finest_level : std::min(truth.finest_level, plan.finest_level);
  truth.coarsest_level = std::max(truth.coarsest_level, plan.coarsest_level);
  truth.undersampled = truth.undersampled || plan.undersampled;
  truth.geometry_error_px = std::max(truth.geometry_error_px, geometry_error_px);
  truth.tiles = std::max(truth.tiles, cells);
  truth.expected_rmse = planned.expected_rmse;
}

void note_damage(const std::set<std::string>& damage, Truth& truth) {
  for (const std::string& message : damage)
    if (message.starts_with(truth.map_path)) truth.damage.push_back(message);
}

WorkTotals work_so_far(const Scene& scene, const tile::CellCache& cache) {
  WorkTotals t;
  std::vector<const tile::MapDescription*> seen;
  for (const Layer& layer : scene.layers()) {
    const tile::Map& map = layer.source->map();
    if (std::find(seen.begin(), seen.end(), &map.description()) != seen.end()) continue;
    seen.push_back(&map.description());
    t.projection_points += map.projection().library_points();
    t.windows_read += map.counters().windows_read;
    t.samples_read += map.counters().samples_read;
  }
  t.cells_loaded = cache.counters().loads;
  return t;
}

void count_work(const WorkTotals& before, const WorkTotals& after, FrameCounters& counters) {
  counters.projection_points = after.projection_points - before.projection_points;
  counters.windows_read = after.windows_read - before.windows_read;
  counters.samples_read = after.samples_read - before.samples_read;
  counters.cells_loaded = after.cells_loaded - before.cells_loaded;
}

}  // namespace nadir::render

#include "explain.h"

#include <map>

#include "pass.h"

namespace nadir::render {
namespace {

std::vector<LevelUse> levels_of(const LayerPlan& plan) {
  std::map<int, LevelUse> found;
  for (const PlannedBlock& block : plan.blocks)
    for (const LevelWindow& window : block.windows) {
      LevelUse& use = found[window.level];
      use.level = window.level;
      ++use.blocks;
      use.pixels += static_cast<std::int64_t>(block.rect.width) * block.rect.height;
    }
  std::vector<LevelUse> levels;
  for (const auto& [level, use] : found) levels.push_back(use);
  return levels;
}

}  // namespace

LayerExplanation explain_layer(const Layer& layer, const PatchMapping& mapping, bool mapping_shared,
                               const LayerPlan& plan, const Truth& truth) {
  const tile::Map& map = layer.source->map();
  LayerExplanation out;
  out.name = layer.name;
  out.map = map.description().path;
  out.crs = map.projection().name();
  out.role = layer.options.role;
  out.type = layer.source->type();
  out.bands = static_cast<int>(layer.source->bands().size());
  out.bands_of_map = static_cast<int>(map.description().bands.size());

  out.mapping_shared = mapping_shared;
  out.closed_form = !map.projection().uses_library();
  for (const Patch& patch : mapping.patches) {
    out.homographies += patch.kind == Patch::Kind::Homography;
    out.quadratics += patch.kind == Patch::Kind::Biquadratic;
    out.patches_by_pixel += patch.kind == Patch::Kind::PerPixel;
  }
  out.mapping_error_px = mapping.error_px;
  out.tolerance_px = mapping.tolerance_px;

  out.filter = truth.filter;
  out.oversampling = truth.oversampling;
  out.levels_of_map = static_cast<int>(map.levels().size());
  out.levels = levels_of(plan);
  out.blocks = static_cast<std::int64_t>(plan.blocks.size());
  out.samples = plan.samples;
  out.pixels = static_cast<std::int64_t>(truth.width) * truth.height;
  out.pixels_sampled = plan.pixels_sampled;
  out.pixels_no_ground = plan.pixels_no_ground;
  out.pixels_off_map = plan.pixels_off_map;
  std::vector<tile::CellKey> cells;
  add_cells(plan, cells);
  out.cells = static_cast<std::int64_t>(cells.size());
  out.cell_bytes = static_cast<std::uint64_t>(out.cells) * layer.source->cell_bytes();
  out.undersampled = plan.undersampled;
  out.expected_rmse = truth.expected_rmse;
  out.coarse = truth.coarse;
  return out;
}

void finish_explanation(const Scene& scene, const Camera& camera, const FrameCounters& counters,
                        Explanation& explanation) {
  explanation.plane = scene.surface().plane() != nullptr;
  explanation.ideal_lens = camera.lens().ideal();
  explanation.counters = counters;
}

}  // namespace nadir::render

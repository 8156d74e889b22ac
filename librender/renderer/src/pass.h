#pragma once

#include <set>
#include <span>
#include <string>
#include <vector>

#include "nadir/render/frame.h"
#include "nadir/render/layer_plan.h"
#include "nadir/tile/cell_cache.h"

namespace nadir::render {

/// A block to be sampled, with where its pixels go.
struct WorkItem {
  const PlannedBlock* block;
  const tile::CellSource* source;
  void* samples = nullptr;           // the frame layer's first, of the first of `rows`
  std::uint8_t* validity = nullptr;  // likewise
  std::size_t stride_px = 0;
  RowRange rows;         // that the frame layer holds
  bool follows = false;  // samples lie where those of the items before lie, of which the first one does not follow
};

/// All items of a frame's layers: those of layers on one grid, whose blocks lie at the same places, side by side.
std::vector<WorkItem> in_groups(std::span<const std::vector<WorkItem>> layers);

/// Pins the cells of `items`, then samples them in parallel; where the cells do not fit the cache at once, in several
/// passes. Adds what it took to `counters`, and to `damage` what was found of damaged tiles, whose texels are invalid.
Result<void> run_passes(std::span<const WorkItem> items, tile::CellCache& cache, FrameCounters& counters,
                        std::set<std::string>& damage);

/// All cells of `items`, each once, in the order of their addresses.
std::vector<tile::CellRequest> wanted_cells(std::span<const WorkItem> items);

/// Adds the cells that the blocks of a layer may sample to `cells`, which are sorted, each once. Their source is 0.
void add_cells(const LayerPlan& plan, std::vector<tile::CellKey>& cells);

}  // namespace nadir::render

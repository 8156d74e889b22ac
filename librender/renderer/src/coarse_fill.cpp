#include "coarse_fill.h"

#include <algorithm>

#include "pass.h"

namespace nadir::render {
namespace {

/// More sources than this at a time, and what the first of them missed is wanted no more.
constexpr std::size_t most_sources = 64;

/// Levels from what was planned to what is loaded first.
constexpr int stopgap_levels = 2;

/// Above that of Renderer::prefetch: these frames are there already.
constexpr int missing_priority = 1, stopgap_priority = 2;

bool before(const tile::CellRequest& a, const tile::CellRequest& b) {
  return std::tie(a.level, a.row, a.col) < std::tie(b.level, b.row, b.col);
}

/// Cells of one source, and which of them are in memory.
class Inventory {
 public:
  Inventory(std::span<const WorkItem> items, tile::CellCache& cache) : cells_(wanted_cells(items)) {
    std::sort(cells_.begin(), cells_.end(), before);
    held_ = cache.held(cells_);
  }

  /// `whole`: and none of them damaged.
  bool has(const WorkItem& item, bool whole) const {
    const auto cells = wanted_cells({&item, 1});
    return std::all_of(cells.begin(), cells.end(), [&](const tile::CellRequest& cell) {
      const auto at = std::lower_bound(cells_.begin(), cells_.end(), cell, before) - cells_.begin();
      const tile::CellPtr& held = held_[static_cast<std::size_t>(at)];
      return held && (!whole || held->damage().empty());
    });
  }
  std::vector<tile::CellRequest> missing() const {
    std::vector<tile::CellRequest> cells;
    for (std::size_t i = 0; i < cells_.size(); ++i)
      if (!held_[i]) cells.push_back(cells_[i]);
    return cells;
  }
  const std::vector<tile::CellPtr>& held() const { return held_; }

 private:
  std::vector<tile::CellRequest> cells_;  // sorted
  std::vector<tile::CellPtr> held_;
};

}  // namespace

void MissingCells::want(std::uint64_t source, tile::CellCache::Ticket ticket, bool replace) {
  const std::scoped_lock lock(mutex_);
  auto found = std::find_if(wanted_.begin(), wanted_.end(), [&](const Wanted& w) { return w.source == source; });
  if (found == wanted_.end()) {
    if (wanted_.size() == most_sources) wanted_.pop_front();
    wanted_.push_back({source, {}});
    found = std::prev(wanted_.end());
  }
  if (replace) found->tickets.clear();
  found->tickets.push_back(std::move(ticket));
}

bool may_be_coarse(const Layer& layer) {
  return layer.options.role != tile::Role::Labels ||
         layer.source->map().description().role == tile::to_string(tile::Role::Labels);
}

MemoryPlan sample_from_memory(const Layer& layer, double pixels, bool first, tile::CellCache& cache,
                              MissingCells& missing, LayerPlan& plan) {
  struct Open {
    PlannedBlock* block;
    int planned;  // finest level
  };
  MemoryPlan result;
  const tile::Map& map = layer.source->map();
  const int coarsest = static_cast<int>(map.levels().size()) - 1;
  std::vector<Open> open;
  for (PlannedBlock& block : plan.blocks)
    if (block.windows.front().level < coarsest) open.push_back({&block, block.windows.front().level});

  std::vector<tile::CellRequest> wanted, stopgaps;
  std::int64_t coarse_pixels = 0;
  for (int coarser = 0; !open.empty(); ++coarser) {
    std::vector<WorkItem> items;
    for (const Open& o : open) items.push_back({o.block, layer.source.get()});
    const Inventory inventory(items, cache);
    if (coarser == 0) wanted = inventory.missing();
    if (coarser == stopgap_levels) stopgaps = inventory.missing();
    result.held.insert(result.held.end(), inventory.held().begin(), inventory.held().end());

    std::vector<Open> still;
    for (std::size_t i = 0; i < open.size(); ++i) {
      if (inventory.has(items[i], coarser > 0)) continue;
      PlannedBlock& block = *open[i].block;
      if (coarser == 0) coarse_pixels += static_cast<std::int64_t>(block.rect.width) * block.rect.height;
      coarsen(block, map);
      const int level = block.windows.front().level;
      result.fill.levels = std::max(result.fill.levels, level - open[i].planned);
      if (level < coarsest) still.push_back(open[i]);
    }
    open = std::move(still);
  }
  result.fill.fraction = static_cast<double>(coarse_pixels) / pixels;
  if (coarse_pixels > 0) {
    plan.finest_level = coarsest;
    plan.coarsest_level = 0;
    for (const PlannedBlock& block : plan.blocks) {
      plan.finest_level = std::min(plan.finest_level, block.windows.front().level);
      plan.coarsest_level = std::max(plan.coarsest_level, block.windows.back().level);
    }
  }
  const std::uint64_t source = layer.source->id();
  missing.want(source, cache.prefetch(stopgaps, stopgap_priority), first);
  missing.want(source, cache.prefetch(wanted, missing_priority), false);
  return result;
}

}  // namespace nadir::render

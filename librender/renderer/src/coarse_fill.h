#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include "nadir/render/layer_plan.h"
#include "nadir/render/scene.h"
#include "nadir/render/truth.h"
#include "nadir/tile/cell_cache.h"

namespace nadir::render {

/// What was missing in memory is loaded in the background until a later frame misses other cells of the same source.
/// Thread-safe.
class MissingCells {
 public:
  /// `replace`: what that source missed before is wanted no more, as far as it has not begun.
  void want(std::uint64_t source, tile::CellCache::Ticket ticket, bool replace);

 private:
  struct Wanted {
    std::uint64_t source;
    std::vector<tile::CellCache::Ticket> tickets;
  };
  std::mutex mutex_;           // guards what follows
  std::deque<Wanted> wanted_;  // of the latest sources
};

/// Whether coarser levels may stand for finer ones of a layer. Of labels where the map says that it holds labels, as
/// nadir build has it say whose levels take the most frequent or the nearest one: levels that somebody else reduced may
/// hold means of labels.
bool may_be_coarse(const Layer& layer);

/// A plan changed to sample what is in memory.
struct MemoryPlan {
  CoarseFill fill;
  std::vector<tile::CellPtr> held;  // what was found, and may be sampled
};

/// Has each block of `plan` whose cells are not all in memory sampled from the finest coarser levels whose cells are,
/// none of them damaged; in the last resort from the coarsest, which are left to be loaded. What was missing is loaded
/// in the background, before it what is two levels coarser, whose 16th of the cells comes soon. `pixels`: of the image.
MemoryPlan sample_from_memory(const Layer& layer, double pixels, bool first, tile::CellCache& cache,
                              MissingCells& missing, LayerPlan& plan);

}  // namespace nadir::render

#pragma once

#include <tbb/task_arena.h>

#include <vector>

#include "coarse_fill.h"
#include "nadir/render/expected_error.h"
#include "nadir/render/renderer.h"

namespace nadir::render {

/// GDAL keeps decoded blocks of its own: an eighth of the budget, so that neighbouring cells do not decode a block
/// twice.
struct Renderer::Engine {
  explicit Engine(const RendererOptions& options)
      : cache(options.cache_bytes - options.cache_bytes / 8, options.threads),
        arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic),
        frames(std::make_shared<FrameMemory>(options.spare_frame_bytes)) {
    tile::limit_gdal_block_cache(options.cache_bytes / 8);
  }
  tile::CellCache cache;
  tbb::task_arena arena;
  ErrorModel error_model;
  MissingCells missing;
  std::shared_ptr<FrameMemory> frames;
};

/// Rows of a frame that is made in bands, and how its layers are sampled in each instant: decided for the whole frame.
struct Renderer::Band {
  RowRange rows;
  const std::vector<std::vector<Sampling>>& sampling;  // of instants, of layers
};

}  // namespace nadir::render

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

#include "nadir/render/patches.h"
#include "nadir/render/quality.h"
#include "nadir/render/sample_block.h"

namespace nadir::render {

/// A block of pixels of one layer, ready to be sampled once its cells are pinned. Across the two ends of a map that
/// goes around the Earth, its texels are counted on from some turn: see LevelWindow::around.
struct PlannedBlock {
  PixelRect rect;
  BlockSampling sampling;               // but for its levels, which exist once their cells are pinned
  std::vector<LevelWindow> windows;     // but for their cells
  Eigen::Vector2d seen_min, seen_max;   // texels of level 0, on the map, without the footprints' margins
  std::vector<Eigen::Vector2d> texels;  // of a per-pixel block; sampling.texels refers to them
  double longest_texels = 0;            // of its pixels' footprints, along their longer axes
  bool undersampled = false;            // some pixel spans more texels than it takes samples of
};

static_assert(std::is_nothrow_move_constructible_v<PlannedBlock>, "lists of blocks would copy them when they grow");

/// Whether the pixels of two blocks are sampled at the same places of maps on the same grid, in the same way. Not
/// looked into where each pixel's texels are given.
bool same_places(const PlannedBlock& a, const PlannedBlock& b);

/// How one layer of a frame will be made. What sees nothing has no block.
struct LayerPlan {
  std::vector<PlannedBlock> blocks;
  std::int64_t pixels_sampled = 0, samples = 0;  // bilinear samples, each of one or two levels
  std::int64_t pixels_no_ground = 0, pixels_off_map = 0;
  int finest_level = 0, coarsest_level = 0;  // that any block may sample
  bool undersampled = false;                 // some block is: the map has too few levels for this view
};

/// Samples taken at most along one side of a pixel. A map with levels never needs as many.
inline constexpr int most_samples_a_side = 16;
inline constexpr int most_reference_samples_a_side = 256;

/// Cuts the mapping's patches into blocks of at most `block_px` a side and finds for each what it samples: the levels
/// from the footprint at its corners, and the cells that its outline may touch. `rows`: blocks that meet none of them
/// are left out; the others are those of the whole image.
LayerPlan plan_layer(const PatchMapping& mapping, const tile::CellSource& source, const Sampling& sampling,
                     const RowRange& rows = {});

/// Has a block sampled from no level finer than the one after its finest. That level must be there.
void coarsen(PlannedBlock& block, const tile::Map& map);

}  // namespace nadir::render

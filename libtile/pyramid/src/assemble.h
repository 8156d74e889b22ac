#pragma once

#include <cstdint>
#include <span>

#include "disk_file.h"
#include "nadir/base/progress.h"
#include "nadir/tiff/cog.h"
#include "tile_table.h"

namespace nadir::pyramid {

/// Copies all packed tiles from where they were spooled to where they lie in the map.
/// `spools`: as TileTable::Place counts files. A tile at a time is told to `progress`.
Result<void> gather_tiles(const DiskFile& map, const tiff::CogArrangement& arrangement, const TileTable& table,
                          std::span<const DiskFile* const> spools, int threads, Progress& progress);

/// Writes all but the tiles: header and losses.
Result<void> write_frame(const DiskFile& map, const tiff::CogImage& image, const tiff::CogArrangement& arrangement,
                         const TileTable& table);

/// Where tiles are known to lie before they are packed: writes a chunk's to their places.
Result<void> write_tiles_in_place(const DiskFile& map, const tiff::CogArrangement& arrangement, const LevelPlan& plan,
                                  const ChunkRecord& record, std::span<const std::byte> tiles);

}  // namespace nadir::pyramid

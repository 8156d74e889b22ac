#pragma once

#include <cstdint>
#include <vector>

#include "journal.h"
#include "levels.h"
#include "nadir/tiff/cog.h"

namespace nadir::pyramid {

/// Where each packed tile of a map lies, in one of several files, until they are brought into order.
class TileTable {
 public:
  struct Place {
    std::uint32_t file = 0;
    std::uint64_t offset = 0;  // of the tile's leader
  };

  /// `with_mask`: each tile has one of its own.
  TileTable(const LevelPlan& plan, int data_bands, bool with_mask);

  /// Enters a chunk's tiles. False, and nothing changes, where the record cannot be of this map or where tiles would
  /// lie beyond `file_bytes`.
  bool add(const ChunkRecord& record, std::uint32_t file, std::uint64_t file_bytes);

  const std::vector<tiff::TileSizes>& sizes() const { return sizes_; }
  const std::vector<tiff::TileLosses>& losses() const { return losses_; }
  Place place(int level, std::size_t tile) const;
  /// Bytes of a tile in a file with its mask, leaders and trailers; 0 where there is none.
  std::uint64_t stored_bytes(int level, std::size_t tile) const;

 private:
  const LevelPlan& plan_;
  std::size_t data_bands_;
  bool with_mask_;
  std::vector<std::vector<std::uint64_t>> places_;  // a level's: file in the upper 16 bits
  std::vector<tiff::TileSizes> sizes_;
  std::vector<tiff::TileLosses> losses_;
};

/// Bytes of a packed tile with its mask, leaders and trailers; 0 where there is none.
std::uint64_t stored_bytes(const PackedSize& size);

}  // namespace nadir::pyramid

#include "tile_table.h"

#include <algorithm>

namespace nadir::pyramid {
namespace {

constexpr int offset_bits = 48;
constexpr std::uint64_t around_tile = tiff::tile_leader_bytes + tiff::tile_trailer_bytes;

}  // namespace

std::uint64_t stored_bytes(const PackedSize& size) {
  return (size.imagery > 0 ? size.imagery + around_tile : 0) + (size.mask > 0 ? size.mask + around_tile : 0);
}

TileTable::TileTable(const LevelPlan& plan, int data_bands, bool with_mask)
    : plan_(plan), data_bands_(static_cast<std::size_t>(data_bands)), with_mask_(with_mask) {
  const std::size_t levels = plan.sizes().size();
  for (std::size_t level = 0; level < levels; ++level) {
    const auto count = static_cast<std::size_t>(plan.tiles(static_cast<int>(level)).count());
    places_.emplace_back(count);
    sizes_.push_back({std::vector<std::uint32_t>(count), std::vector<std::uint32_t>(with_mask ? count : 0)});
    losses_.emplace_back(level + 1 < levels ? count * data_bands_ : 0);
  }
}

bool TileTable::add(const ChunkRecord& record, std::uint32_t file, std::uint64_t file_bytes) {
  if (record.stage < 0 || static_cast<std::size_t>(record.stage) >= plan_.stages().size()) return false;
  const Stage& stage = plan_.stages()[static_cast<std::size_t>(record.stage)];
  const TileRange chunks = plan_.chunks(stage);
  const Chunk& chunk = record.chunk;
  if (chunk.col < 0 || chunk.row < 0 || chunk.col >= chunks.cols || chunk.row >= chunks.rows) return false;
  if (!record.holds_data) return true;

  std::uint64_t tiles = 0, bytes = 0;
  for (int level = stage.first; level < stage.first + stage.levels; ++level)
    tiles += static_cast<std::uint64_t>(plan_.tiles_of(stage, chunk, level).count());
  for (const PackedSize& size : record.tiles) {
    if (!with_mask_ && size.mask > 0) return false;
    bytes += pyramid::stored_bytes(size);
  }
  if (record.tiles.size() != tiles || record.losses.size() != tiles * data_bands_ || bytes > file_bytes ||
      record.tiles_at > file_bytes - bytes || record.tiles_at >> offset_bits != 0)
    return false;

  std::uint64_t offset = record.tiles_at;
  std::size_t i = 0;
  for (int level = stage.first; level < stage.first + stage.levels; ++level) {
    const auto at = static_cast<std::size_t>(level);
    const TileRange range = plan_.tiles_of(stage, chunk, level);
    const auto across = static_cast<std::size_t>(plan_.tiles(level).cols);
    for (std::int32_t row = range.row; row < range.row + range.rows; ++row) {
      for (std::int32_t col = range.col; col < range.col + range.cols; ++col, ++i) {
        const std::size_t tile = static_cast<std::size_t>(row) * across + static_cast<std::size_t>(col);
        places_[at][tile] = std::uint64_t{file} << offset_bits | offset;
        sizes_[at].imagery[tile] = record.tiles[i].imagery;
        if (with_mask_) sizes_[at].mask[tile] = record.tiles[i].mask;
        if (!losses_[at].empty())
          std::copy_n(record.losses.begin() + static_cast<std::ptrdiff_t>(i * data_bands_), data_bands_,
                      losses_[at].begin() + static_cast<std::ptrdiff_t>(tile * data_bands_));
        offset += pyramid::stored_bytes(record.tiles[i]);
      }
    }
  }
  return true;
}

TileTable::Place TileTable::place(int level, std::size_t tile) const {
  const std::uint64_t place = places_[static_cast<std::size_t>(level)][tile];
  return {static_cast<std::uint32_t>(place >> offset_bits), place & ((std::uint64_t{1} << offset_bits) - 1)};
}

std::uint64_t TileTable::stored_bytes(int level, std::size_t tile) const {
  const tiff::TileSizes& sizes = sizes_[static_cast<std::size_t>(level)];
  return pyramid::stored_bytes({sizes.imagery[tile], with_mask_ ? sizes.mask[tile] : 0});
}

}  // namespace nadir::pyramid

#include "assemble.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <mutex>
#include <optional>

namespace nadir::pyramid {
namespace {

/// Bytes to be copied from one file to the map. Grows as long as what follows lies behind it in both.
struct Run {
  std::uint32_t file = 0;
  std::uint64_t from = 0, to = 0, bytes = 0;

  bool grows_by(const TileTable::Place& place, std::uint64_t at) const {
    return bytes > 0 && place.file == file && place.offset == from + bytes && at == to + bytes;
  }
};

Result<void> gather_some(const DiskFile& map, const tiff::CogArrangement& arrangement, const TileTable& table,
                         std::span<const DiskFile* const> spools, int level, std::size_t begin, std::size_t end) {
  const auto& offsets = arrangement.imagery[static_cast<std::size_t>(level)];
  Run run;
  const auto copy = [&]() -> Result<void> {
    return run.bytes == 0 ? Result<void>() : map.copy_from(*spools[run.file], run.from, run.to, run.bytes);
  };
  for (std::size_t tile = begin; tile < end; ++tile) {
    const std::uint64_t bytes = table.stored_bytes(level, tile);
    if (bytes == 0) continue;
    const TileTable::Place place = table.place(level, tile);
    const std::uint64_t at = offsets[tile] - tiff::tile_leader_bytes;
    if (!run.grows_by(place, at)) {
      if (const auto ok = copy(); !ok) return ok;
      run = {place.file, place.offset, at, 0};
    }
    run.bytes += bytes;
  }
  return copy();
}

}  // namespace

Result<void> gather_tiles(const DiskFile& map, const tiff::CogArrangement& arrangement, const TileTable& table,
                          std::span<const DiskFile* const> spools, int threads, Progress& progress) {
  constexpr std::size_t tiles_at_once = 256;
  std::mutex error_mutex;
  std::optional<Error> error;
  tbb::task_arena arena(threads);
  for (int level = static_cast<int>(arrangement.imagery.size()) - 1; level >= 0; --level) {
    const std::size_t count = arrangement.imagery[static_cast<std::size_t>(level)].size();
    arena.execute([&] {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, tiles_at_once), [&](const auto& range) {
        if (auto ok = gather_some(map, arrangement, table, spools, level, range.begin(), range.end()); !ok) {
          std::scoped_lock lock(error_mutex);
          error = ok.error();
        }
        progress.advance(static_cast<std::int64_t>(range.size()));
      });
    });
    if (error) return tl::unexpected(*error);
  }
  return {};
}

Result<void> write_frame(const DiskFile& map, const tiff::CogImage& image, const tiff::CogArrangement& arrangement,
                         const TileTable& table) {
  const auto header = tiff::header(image, table.sizes(), table.losses(), arrangement);
  if (!header) return fail(header);
  if (const auto ok = map.write(0, *header); !ok) return ok;
  for (std::size_t level = 0; level < arrangement.losses.size(); ++level)
    if (arrangement.losses[level] > 0)
      if (const auto ok = map.write(arrangement.losses[level], std::as_bytes(std::span(table.losses()[level]))); !ok)
        return ok;
  return map.resize(arrangement.file_bytes);
}

Result<void> write_tiles_in_place(const DiskFile& map, const tiff::CogArrangement& arrangement, const LevelPlan& plan,
                                  const ChunkRecord& record, std::span<const std::byte> tiles) {
  const Stage& stage = plan.stages()[static_cast<std::size_t>(record.stage)];
  std::size_t i = 0;
  for (int level = stage.first; level < stage.first + stage.levels; ++level) {
    const TileRange range = plan.tiles_of(stage, record.chunk, level);
    for (std::int32_t row = 0; row < range.rows; ++row) {
      // Tiles of a row lie behind one another in the map too.
      std::size_t bytes = 0;
      for (std::int32_t col = 0; col < range.cols; ++col) bytes += stored_bytes(record.tiles[i++]);
      const std::size_t first =
          static_cast<std::size_t>(range.row + row) * static_cast<std::size_t>(plan.tiles(level).cols) +
          static_cast<std::size_t>(range.col);
      const std::uint64_t at = arrangement.imagery[static_cast<std::size_t>(level)][first] - tiff::tile_leader_bytes;
      if (const auto ok = map.write(at, tiles.first(bytes)); !ok) return ok;
      tiles = tiles.subspan(bytes);
    }
  }
  return {};
}

}  // namespace nadir::pyramid

#include "engine.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <optional>

namespace nadir::pyramid {
namespace {

Window joined(const Window& a, const Window& b) {
  const std::int32_t x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x, std::max(a.y + a.height, b.y + b.height) - y};
}

std::uint64_t bytes_of(const TexelType& type, const Window& window) {
  return static_cast<std::uint64_t>(window.width) * static_cast<std::uint64_t>(window.height) *
         (type.texel_bytes() + (type.mask ? 1 : 0));
}

/// Of a square of side * side tiles, row by row: halved to one, always the same four together, so that the last bits
/// do not depend on how levels are divided into stages.
std::vector<BandStatistics> merged(std::vector<std::vector<BandStatistics>> tiles, std::size_t side,
                                   std::size_t bands) {
  for (; side > 1; side /= 2) {
    std::vector<std::vector<BandStatistics>> halved(side / 2 * (side / 2), std::vector<BandStatistics>(bands));
    for (std::size_t row = 0; row < side; ++row)
      for (std::size_t col = 0; col < side; ++col)
        for (std::size_t b = 0; b < bands; ++b)
          halved[row / 2 * (side / 2) + col / 2][b].add(tiles[row * side + col][b]);
    tiles = std::move(halved);
  }
  return std::move(tiles.front());
}

}  // namespace

/// What a worker keeps from chunk to chunk.
struct Engine::Scratch {
  std::vector<Block> levels;  // of a stage, the one handed on too
  RawBytes packed;
};

Engine::Engine(const mosaic::Mosaic& mosaic, const LevelPlan& plan, const Reduction& reduction,
               const TilePacker& packer, TileTable& table)
    : mosaic_(mosaic),
      plan_(plan),
      type_(mosaic.type()),
      packer_(packer),
      table_(table),
      done_(plan.stages().size()),
      statistics_(static_cast<std::size_t>(mosaic.type().data_bands())) {
  const auto& sizes = plan.sizes();
  for (std::size_t k = 0; k + 1 < sizes.size(); ++k) reducers_.emplace_back(type_, reduction, sizes[k], sizes[k + 1]);
  for (const Stage& stage : plan.stages())
    if (stage.hands_on) raw_.push_back(std::make_unique<RawLevel>(type_, plan, stage.first + stage.levels));
}

Result<void> Engine::take_over(Workspace& workspace, std::uint64_t tile_file_bytes) {
  workspace_ = &workspace;
  std::vector<std::uint32_t> raw_files;
  for (std::size_t stage = 0; stage < raw_.size(); ++stage) {
    auto file = DiskFile::open(workspace.file("stage" + std::to_string(stage)));
    if (!file) return fail(file);
    const auto index = raw_[stage]->add_file(std::move(*file));
    if (!index) return fail(index);
    raw_files.push_back(*index);
  }
  for (const ChunkRecord& record : workspace.journal().records()) {
    const auto stage = static_cast<std::size_t>(std::max(record.stage, 0));
    enter(record, workspaces_, tile_file_bytes, stage < raw_files.size() ? raw_files[stage] : 0);
  }
  workspace.journal().forget_records();
  ++workspaces_;
  return {};
}

bool Engine::enter(const ChunkRecord& record, std::uint32_t tile_file, std::uint64_t tile_file_bytes,
                   std::uint32_t raw_file) {
  if (record.holds_data && record.statistics.size() != statistics_.size()) return false;
  std::scoped_lock lock(mutex_);
  if (!table_.add(record, tile_file, tile_file_bytes)) return false;
  const auto stage = static_cast<std::size_t>(record.stage);
  if (record.holds_data) {
    if (stage == raw_.size())
      statistics_ = record.statistics;
    else if (!raw_[stage]->add(record.chunk.col, record.chunk.row, raw_file, record.handed_on_at, record.statistics))
      return false;
  }
  done_[stage].insert(record.chunk);
  return true;
}

std::int64_t Engine::tiles_in(int stage, const Chunk& chunk) const {
  const Stage& s = plan_.stages()[static_cast<std::size_t>(stage)];
  std::int64_t tiles = 0;
  for (int level = s.first; level < s.first + s.levels; ++level) tiles += plan_.tiles_of(s, chunk, level).count();
  return tiles;
}

/// Texels of each level of the stage that a chunk is made of: its own, and those around them that its coarser levels
/// and the losses of its tiles depend on.
std::vector<Window> Engine::windows_of(const Stage& stage, const Chunk& chunk) const {
  const int end = stage.first + stage.levels + (stage.hands_on ? 1 : 0);
  std::vector<Window> windows(static_cast<std::size_t>(end - stage.first));
  for (int level = end - 1; level >= stage.first; --level) {
    const Window own = plan_.window_of(level, plan_.tiles_of(stage, chunk, level));
    Window& window = windows[static_cast<std::size_t>(level - stage.first)];
    window = own;
    if (level > stage.first) {
      const Window finer = plan_.window_of(level - 1, plan_.tiles_of(stage, chunk, level - 1));
      window = joined(window, reducers_[static_cast<std::size_t>(level) - 1].parents(finer));
    }
    if (level + 1 < end)
      window = joined(window, reducers_[static_cast<std::size_t>(level)].needed(
                                  windows[static_cast<std::size_t>(level + 1 - stage.first)]));
  }
  return windows;
}

bool Engine::reaches(int stage, const Window& window) const {
  return stage == 0 ? mosaic_.reaches(window) : handed_on_by(stage - 1).reaches(window);
}

std::vector<Chunk> Engine::chunks(int stage, bool depth_first) const {
  const Stage& s = plan_.stages()[static_cast<std::size_t>(stage)];
  const TileRange all = plan_.chunks(s);
  std::vector<Chunk> found;
  std::int32_t side = 1;
  while (side < std::max(all.cols, all.rows)) side *= 2;
  add_chunks_depth_first(stage, {0, 0}, side, found);
  if (!depth_first)
    std::sort(found.begin(), found.end(),
              [](const Chunk& a, const Chunk& b) { return std::pair(a.row, a.col) < std::pair(b.row, b.col); });
  return found;
}

void Engine::add_chunks_depth_first(int stage, const Chunk& corner, std::int32_t side,
                                    std::vector<Chunk>& found) const {
  const Stage& s = plan_.stages()[static_cast<std::size_t>(stage)];
  const TileRange all = plan_.chunks(s);
  if (corner.col >= all.cols || corner.row >= all.rows) return;
  // The whole square's window is what its first and last chunk need, and all between them.
  const Chunk last{std::min(corner.col + side, all.cols) - 1, std::min(corner.row + side, all.rows) - 1};
  if (!reaches(stage, joined(windows_of(s, corner).front(), windows_of(s, last).front()))) return;
  if (side == 1) {
    found.push_back(corner);
    return;
  }
  const std::int32_t half = side / 2;
  for (const Chunk& quarter : {corner, Chunk{corner.col + half, corner.row}, Chunk{corner.col, corner.row + half},
                               Chunk{corner.col + half, corner.row + half}})
    add_chunks_depth_first(stage, quarter, half, found);
}

std::uint64_t Engine::worker_bytes() const {
  const Stage& stage = plan_.stages().front();
  const TileRange chunks = plan_.chunks(stage);
  const Chunk inner{std::min(1, chunks.cols - 1), std::min(1, chunks.rows - 1)};
  std::uint64_t bytes = 0;
  for (const Window& window : windows_of(stage, inner)) bytes += bytes_of(type_, window);
  return 2 * bytes;  // unpacked, and packed at worst
}

Result<void> Engine::pack(const Stage& stage, Scratch& scratch, ChunkRecord& record) const {
  const auto bands = static_cast<std::size_t>(type_.data_bands());
  scratch.packed.clear();
  for (int level = stage.first; level < stage.first + stage.levels; ++level) {
    const auto at = static_cast<std::size_t>(level - stage.first);
    const TileRange range = plan_.tiles_of(stage, record.chunk, level);
    for (std::int32_t row = range.row; row < range.row + range.rows; ++row) {
      for (std::int32_t col = range.col; col < range.col + range.cols; ++col) {
        const Window window = plan_.window_of(level, {col, row, 1, 1});
        const auto size = packer_.pack(scratch.levels[at], window, scratch.packed);
        if (!size) return fail(size);
        record.tiles.push_back(*size);
        record.losses.resize(record.losses.size() + bands, 0.0f);
        if (size->imagery > 0 && static_cast<std::size_t>(level) < reducers_.size())
          reducers_[static_cast<std::size_t>(level)].loss(scratch.levels[at], window, scratch.levels[at + 1],
                                                          std::span(record.losses).last(bands));
      }
    }
  }
  return {};
}

std::vector<BandStatistics> Engine::statistics_of(int stage, const Chunk& chunk, const Block& finest) const {
  const Stage& s = plan_.stages()[static_cast<std::size_t>(stage)];
  const TileRange range = plan_.tiles_of(s, chunk, s.first);
  const std::size_t side = std::size_t{1} << plan_.depth(), bands = statistics_.size();
  std::vector<std::vector<BandStatistics>> tiles(side * side, std::vector<BandStatistics>(bands));
  for (std::int32_t row = 0; row < range.rows; ++row) {
    for (std::int32_t col = 0; col < range.cols; ++col) {
      const TileRange tile{range.col + col, range.row + row, 1, 1};
      auto& of_tile = tiles[static_cast<std::size_t>(row) * side + static_cast<std::size_t>(col)];
      if (stage == 0)
        of_tile = pyramid::statistics(type_, finest, plan_.window_of(0, tile));
      else if (const auto* known = handed_on_by(stage - 1).statistics(tile.col, tile.row))
        of_tile = *known;
    }
  }
  return merged(std::move(tiles), side, bands);
}

Result<ChunkRecord> Engine::make(int stage, const Chunk& chunk, const TileSink& sink, Scratch& scratch) {
  const Stage& s = plan_.stages()[static_cast<std::size_t>(stage)];
  ChunkRecord record{stage, chunk, false, 0, {}, {}, 0, {}};
  const std::vector<Window> windows = windows_of(s, chunk);
  scratch.levels.resize(std::max(scratch.levels.size(), windows.size()));
  scratch.levels.front().reset(type_, windows.front());
  auto read = stage == 0 ? mosaic_.read(scratch.levels.front()) : handed_on_by(stage - 1).read(scratch.levels.front());
  if (!read) return fail(read);
  if (tells_holes(type_) && empty(type_, scratch.levels.front(), windows.front())) return record;

  record.holds_data = true;
  for (std::size_t i = 1; i < windows.size(); ++i) {
    scratch.levels[i].reset(type_, windows[i]);
    reducers_[static_cast<std::size_t>(s.first) + i - 1].reduce(scratch.levels[i - 1], scratch.levels[i]);
  }
  record.statistics = statistics_of(stage, chunk, scratch.levels.front());
  if (const auto ok = pack(s, scratch, record); !ok) return fail(ok);
  const auto tiles_at = sink(record, scratch.packed);
  if (!tiles_at) return fail(tiles_at);
  record.tiles_at = *tiles_at;
  if (s.hands_on) {
    const auto at = handed_on_by(stage).store(scratch.levels[windows.size() - 1], chunk.col, chunk.row);
    if (!at) return fail(at);
    record.handed_on_at = *at;
  }
  return record;
}

Result<void> Engine::run(int stage, std::span<const Chunk> chunks, int workers, const TileSink& sink,
                         Progress& progress) {
  std::vector<Chunk> to_do;
  for (const Chunk& chunk : chunks) {
    if (is_done(stage, chunk))
      progress.advance(tiles_in(stage, chunk));
    else
      to_do.push_back(chunk);
  }
  const std::uint32_t own = workspaces_ - 1;
  std::atomic<std::size_t> next{0};
  std::mutex error_mutex;
  std::optional<std::pair<std::size_t, Error>> first_error;  // of the earliest chunk
  const auto work = [&] {
    Scratch scratch;
    for (std::size_t i = next++; i < to_do.size(); i = next++) {
      auto record = make(stage, to_do[i], sink, scratch);
      Result<void> kept = record ? workspace_->journal().append(*record) : fail(record);
      if (!kept) {
        std::scoped_lock lock(error_mutex);
        if (!first_error || i < first_error->first) first_error = {i, kept.error()};
        next = to_do.size();
        return;
      }
      enter(*record, own, std::numeric_limits<std::uint64_t>::max(), own);
      progress.advance(tiles_in(stage, to_do[i]));
    }
  };
  // More threads than cores are of use where sources are waited for.
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(std::max(workers, tbb::this_task_arena::max_concurrency())));
  tbb::task_arena arena(workers);
  arena.execute([&] {
    tbb::parallel_for(
        0, workers, [&](int) { work(); }, tbb::simple_partitioner());
  });
  if (first_error) return tl::unexpected(first_error->second);
  return {};
}

}  // namespace nadir::pyramid

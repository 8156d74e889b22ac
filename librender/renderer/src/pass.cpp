#include "pass.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>

#include "nadir/base/text.h"
#include "nadir/render/stored_runs.h"
#include "stage_timer.h"

namespace nadir::render {
namespace {

struct WantedCell {
  tile::CellKey key;
  const tile::CellSource* source;
  friend bool operator==(const WantedCell& a, const WantedCell& b) { return a.key == b.key; }
  friend bool operator<(const WantedCell& a, const WantedCell& b) { return a.key < b.key; }
};

/// Columns of stored cells that hold a window's texels, each once.
std::vector<std::int32_t> stored_columns(const LevelWindow& window) {
  std::vector<std::int32_t> columns;
  if (window.around) {
    for_each_stored_run(static_cast<std::int64_t>(window.first_col) * tile::cell_size, window.cols * tile::cell_size,
                        window.width, true,
                        [&](const StoredRun& run) { columns.push_back(run.first / tile::cell_size); });
    std::sort(columns.begin(), columns.end());
    columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
  } else {
    for (std::int32_t col = 0; col < window.cols; ++col) columns.push_back(window.first_col + col);
  }
  return columns;
}

/// Rows from the top, in each all columns.
template <class Visit>
void for_each_cell(const LevelWindow& window, const std::vector<std::int32_t>& columns, Visit&& visit) {
  for (std::int32_t row = 0; row < window.rows; ++row)
    for (const std::int32_t col : columns) visit(col, window.first_row + row);
}

void sort_unique(std::vector<WantedCell>& cells) {
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
}

std::vector<WantedCell> cells_of(std::span<const WorkItem> items) {
  std::vector<WantedCell> cells;
  for (const WorkItem& item : items)
    for (const LevelWindow& window : item.block->windows)
      for_each_cell(window, stored_columns(window), [&](std::int32_t col, std::int32_t row) {
        cells.push_back({{item.source->id(), window.level, col, row}, item.source});
      });
  sort_unique(cells);
  return cells;
}

std::vector<tile::CellRequest> requests_for(const std::vector<WantedCell>& cells) {
  std::vector<tile::CellRequest> requests;
  for (const WantedCell& cell : cells) requests.push_back({cell.source, cell.key.level, cell.key.col, cell.key.row});
  return requests;
}

/// Samples a block from pinned cells, which are sorted by address.
void sample(const WorkItem& item, const std::vector<WantedCell>& wanted, const std::vector<tile::CellPtr>& pinned) {
  BlockSampling sampling = item.block->sampling;
  std::vector<LevelWindow> windows = item.block->windows;
  std::vector<std::vector<std::int32_t>> columns(windows.size());
  std::vector<std::vector<const tile::Cell*>> cells(windows.size());
  for (std::size_t i = 0; i < windows.size(); ++i) {
    columns[i] = stored_columns(windows[i]);
    for_each_cell(windows[i], columns[i], [&](std::int32_t col, std::int32_t row) {
      const WantedCell address{{item.source->id(), windows[i].level, col, row}, item.source};
      const auto at = std::lower_bound(wanted.begin(), wanted.end(), address) - wanted.begin();
      cells[i].push_back(pinned[static_cast<std::size_t>(at)].get());
    });
    windows[i].columns = columns[i];
    windows[i].cells = cells[i];
  }
  sampling.levels = windows;
  const PixelRect& rect = item.block->rect;
  const std::size_t pixel_bytes = item.source->bands().size() * tile::size_bytes(item.source->type());
  const int top = std::max(rect.y, item.rows.first);
  const std::size_t first =
      static_cast<std::size_t>(top - item.rows.first) * item.stride_px + static_cast<std::size_t>(rect.x);
  std::byte* samples = static_cast<std::byte*>(item.samples) + first * pixel_bytes;
  std::uint8_t* validity = item.validity + first;
  if (item.rows.shared(rect) == rect.height) {
    sample_block(sampling, *item.source, samples, validity, item.stride_px);
    return;
  }
  // Of a block that lies across the ends of the rows, the part within
  const auto width = static_cast<std::size_t>(rect.width);
  const std::size_t pixels = width * static_cast<std::size_t>(rect.height);
  std::vector<std::byte> all_samples(pixels * pixel_bytes);
  std::vector<std::uint8_t> all_validity(pixels);
  sample_block(sampling, *item.source, all_samples.data(), all_validity.data(), width);
  for (std::size_t y = 0; y < static_cast<std::size_t>(item.rows.shared(rect)); ++y) {
    const std::size_t from = (static_cast<std::size_t>(top - rect.y) + y) * width, to = y * item.stride_px;
    std::memcpy(samples + to * pixel_bytes, all_samples.data() + from * pixel_bytes, width * pixel_bytes);
    std::memcpy(validity + to, all_validity.data() + from, width);
  }
}

}  // namespace

Result<void> run_passes(std::span<const WorkItem> items, tile::CellCache& cache, FrameCounters& counters,
                        std::set<std::string>& damage) {
  if (items.empty()) return {};
  const std::vector<WantedCell> wanted = timed(counters.times.planning_ms, [&] { return cells_of(items); });
  std::uint64_t bytes = 0;
  for (const WantedCell& cell : wanted) bytes += cell.source->cell_bytes();

  const bool one_block = items.size() == 1;
  const auto in_halves = [&]() -> Result<void> {
    if (auto ok = run_passes(items.first(items.size() / 2), cache, counters, damage); !ok) return ok;
    return run_passes(items.subspan(items.size() / 2), cache, counters, damage);
  };
  if (bytes > cache.budget_bytes()) {
    if (!one_block) return in_halves();
    return fail(
        Error::Kind::OverBudget,
        fmt::format("{}: a block of {} x {} pixels needs map tiles of {}, and the cache may hold {}: allow more memory",
                    items[0].source->map().description().path, items[0].block->rect.width, items[0].block->rect.height,
                    format_bytes(bytes), format_bytes(cache.budget_bytes())));
  }

  auto pinned = timed(counters.times.reading_ms, [&] { return cache.pin(requests_for(wanted)); });
  if (!pinned) {
    if (pinned.error().kind == Error::Kind::OverBudget && !one_block) return in_halves();
    return fail(pinned);
  }
  for (const tile::CellPtr& cell : *pinned)
    if (!cell->damage().empty()) damage.insert(cell->damage());
  timed(counters.times.sampling_ms, [&] {
    tbb::parallel_for(std::size_t{0}, items.size(), [&](std::size_t i) { sample(items[i], wanted, *pinned); });
  });
  ++counters.passes;
  return {};
}

std::vector<tile::CellRequest> wanted_cells(std::span<const WorkItem> items) { return requests_for(cells_of(items)); }

void add_cells(const LayerPlan& plan, std::vector<tile::CellKey>& cells) {
  for (const PlannedBlock& block : plan.blocks)
    for (const LevelWindow& window : block.windows)
      for_each_cell(window, stored_columns(window), [&](std::int32_t col, std::int32_t row) {
        cells.push_back({0, window.level, col, row});
      });
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
}

}  // namespace nadir::render

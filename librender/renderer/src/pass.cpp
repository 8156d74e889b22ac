#include "pass.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "nadir/base/text.h"
#include "seam.h"

namespace nadir::render {
namespace {

struct WantedCell {
  tile::CellKey key;
  const tile::CellSource* source;
  friend bool operator==(const WantedCell& a, const WantedCell& b) { return a.key == b.key; }
  friend bool operator<(const WantedCell& a, const WantedCell& b) { return a.key < b.key; }
};

/// As the window counts them.
template <class Visit>
void for_each_place(const LevelWindow& window, Visit&& visit) {
  for (std::int32_t row = 0; row < window.rows; ++row)
    for (std::int32_t col = 0; col < window.cols; ++col) visit(window.first_col + col, window.first_row + row);
}

/// As they are stored, some perhaps several times.
template <class Visit>
void for_each_cell(const LevelWindow& window, Visit&& visit) {
  for_each_place(window, [&](std::int32_t col, std::int32_t row) {
    if (window.around == 0)
      visit(col, row);
    else
      for_each_seam_run(col, window.around, [&](const SeamRun& run) { visit(run.col, row); });
  });
}

void sort_unique(std::vector<WantedCell>& cells) {
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
}

std::vector<WantedCell> cells_of(std::span<const WorkItem> items) {
  std::vector<WantedCell> cells;
  for (const WorkItem& item : items)
    for (const LevelWindow& window : item.block->windows)
      for_each_cell(window, [&](std::int32_t col, std::int32_t row) {
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

/// Fills what of a cell's apron lies in other stored tiles, from those of them that are wanted too: where a block
/// samples across a border it wants the cells on both sides, since what it wants reaches two texels beyond what it
/// sees.
void join_apron(const std::vector<WantedCell>& wanted, const std::vector<tile::CellPtr>& pinned, std::size_t i) {
  const tile::Cell& cell = *pinned[i];
  if (cell.has_whole_apron()) return;
  const auto& [key, source] = wanted[i];
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const tile::ApronPart part{dx, dy};
      if (cell.has(part)) continue;
      const tile::ApronPart holder = source->holder_of(key.level, key.col, key.row, part);
      const WantedCell neighbour{{key.source, key.level, key.col + holder.dx, key.row + holder.dy}, source};
      const auto at = std::lower_bound(wanted.begin(), wanted.end(), neighbour);
      if (at != wanted.end() && *at == neighbour)
        fill_apron(cell, part, *pinned[static_cast<std::size_t>(at - wanted.begin())], holder);
    }
}

/// Samples a block from pinned cells, which are sorted by address.
void sample(const WorkItem& item, const std::vector<WantedCell>& wanted, const std::vector<tile::CellPtr>& pinned) {
  BlockSampling sampling = item.block->sampling;
  std::vector<LevelWindow> windows = item.block->windows;
  std::vector<std::vector<const tile::Cell*>> cells(windows.size());
  std::vector<std::unique_ptr<const tile::Cell>> joined;  // across a map's two ends
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const auto stored = [&](std::int32_t col, std::int32_t row) {
      const WantedCell address{{item.source->id(), windows[i].level, col, row}, item.source};
      const auto at = std::lower_bound(wanted.begin(), wanted.end(), address) - wanted.begin();
      return pinned[static_cast<std::size_t>(at)].get();
    };
    for_each_place(windows[i], [&](std::int32_t col, std::int32_t row) {
      if (windows[i].around == 0) {
        cells[i].push_back(stored(col, row));
      } else {
        auto cell = std::make_unique<tile::Cell>(item.source->type(), static_cast<int>(item.source->bands().size()));
        for_each_seam_run(col, windows[i].around,
                          [&](const SeamRun& run) { copy_run(run, *stored(run.col, row), *cell); });
        cells[i].push_back(cell.get());
        joined.push_back(std::move(cell));
      }
      sampling.masked = sampling.masked || cells[i].back()->masked();
    });
    windows[i].cells = cells[i];
  }
  sampling.levels = windows;
  const PixelRect& rect = item.block->rect;
  const std::size_t first = static_cast<std::size_t>(rect.y) * item.stride_px + static_cast<std::size_t>(rect.x);
  const std::size_t pixel_bytes = item.source->bands().size() * tile::size_bytes(item.source->type());
  sample_block(sampling, *item.source, static_cast<std::byte*>(item.samples) + first * pixel_bytes,
               item.validity + first, item.stride_px);
}

}  // namespace

Result<void> run_passes(std::span<const WorkItem> items, tile::CellCache& cache, FrameCounters& counters,
                        std::set<std::string>& damage) {
  if (items.empty()) return {};
  const std::vector<WantedCell> wanted = cells_of(items);
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

  auto pinned = cache.pin(requests_for(wanted));
  if (!pinned) {
    if (pinned.error().kind == Error::Kind::OverBudget && !one_block) return in_halves();
    return fail(pinned);
  }
  tbb::parallel_for(std::size_t{0}, wanted.size(), [&](std::size_t i) { join_apron(wanted, *pinned, i); });
  for (const tile::CellPtr& cell : *pinned)
    if (!cell->damage().empty()) damage.insert(cell->damage());
  tbb::parallel_for(std::size_t{0}, items.size(), [&](std::size_t i) { sample(items[i], wanted, *pinned); });
  ++counters.passes;
  return {};
}

std::vector<tile::CellRequest> wanted_cells(std::span<const WorkItem> items) { return requests_for(cells_of(items)); }

std::int64_t count_cells(const LayerPlan& plan) {
  std::vector<WantedCell> cells;
  for (const PlannedBlock& block : plan.blocks)
    for (const LevelWindow& window : block.windows)
      for_each_cell(window, [&](std::int32_t col, std::int32_t row) {
        cells.push_back({{0, window.level, col, row}, nullptr});
      });
  sort_unique(cells);
  return static_cast<std::int64_t>(cells.size());
}

}  // namespace nadir::render

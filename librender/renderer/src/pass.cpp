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

/// Pinned cells, sorted by address.
struct PinnedCells {
  const std::vector<WantedCell>& wanted;
  const std::vector<tile::CellPtr>& cells;
  const tile::Cell* at(const WantedCell& address) const {
    return cells[static_cast<std::size_t>(std::lower_bound(wanted.begin(), wanted.end(), address) - wanted.begin())]
        .get();
  }
};

/// A block's windows with their cells.
class CellWindows {
 public:
  CellWindows(const WorkItem& item, const PinnedCells& pinned)
      : windows_(item.block->windows), columns_(windows_.size()), cells_(windows_.size()) {
    for (std::size_t i = 0; i < windows_.size(); ++i) {
      columns_[i] = stored_columns(windows_[i]);
      for_each_cell(windows_[i], columns_[i], [&](std::int32_t col, std::int32_t row) {
        cells_[i].push_back(pinned.at({{item.source->id(), windows_[i].level, col, row}, item.source}));
      });
      windows_[i].columns = columns_[i];
      windows_[i].cells = cells_[i];
    }
  }
  std::span<const LevelWindow> windows() const { return windows_; }

 private:
  std::vector<LevelWindow> windows_;
  std::vector<std::vector<std::int32_t>> columns_;
  std::vector<std::vector<const tile::Cell*>> cells_;
};

/// The part within the rows of a block that lies across their ends: sampled whole, then copied.
struct CroppedBlock {
  std::vector<std::byte> samples;
  std::vector<std::uint8_t> validity;
};

/// Samples blocks that lie at the same places.
void sample(std::span<const WorkItem> items, const PinnedCells& pinned) {
  const WorkItem& first = items.front();
  const PixelRect& rect = first.block->rect;
  const std::size_t pixel_bytes = first.source->bands().size() * tile::size_bytes(first.source->type());
  const int top = std::max(rect.y, first.rows.first), shared = first.rows.shared(rect);
  const std::size_t corner =
      static_cast<std::size_t>(top - first.rows.first) * first.stride_px + static_cast<std::size_t>(rect.x);
  const auto width = static_cast<std::size_t>(rect.width);
  const bool cropped = shared != rect.height;

  std::vector<CellWindows> windows;
  std::vector<BlockTarget> into_frame, targets;
  std::vector<CroppedBlock> whole;
  for (const WorkItem& item : items) {
    windows.emplace_back(item, pinned);
    into_frame.push_back({{}, static_cast<std::byte*>(item.samples) + corner * pixel_bytes, item.validity + corner});
    targets.push_back(into_frame.back());
    if (!cropped) continue;
    const std::size_t pixels = width * static_cast<std::size_t>(rect.height);
    whole.push_back({std::vector<std::byte>(pixels * pixel_bytes), std::vector<std::uint8_t>(pixels)});
    targets.back() = {{}, whole.back().samples.data(), whole.back().validity.data()};
  }
  for (std::size_t i = 0; i < items.size(); ++i) targets[i].levels = windows[i].windows();
  BlockSampling sampling = first.block->sampling;
  sampling.levels = targets.front().levels;
  sample_block(sampling, *first.source, targets, cropped ? width : first.stride_px);

  for (std::size_t i = 0; i < whole.size(); ++i)
    for (std::size_t y = 0; y < static_cast<std::size_t>(shared); ++y) {
      const std::size_t from = (static_cast<std::size_t>(top - rect.y) + y) * width, to = y * first.stride_px;
      std::memcpy(static_cast<std::byte*>(into_frame[i].samples) + to * pixel_bytes,
                  whole[i].samples.data() + from * pixel_bytes, width * pixel_bytes);
      std::memcpy(into_frame[i].validity + to, whole[i].validity.data() + from, width);
    }
}

/// The first item of each group of those that are sampled together, and the end of all.
std::vector<std::size_t> group_borders(std::span<const WorkItem> items) {
  std::vector<std::size_t> borders;
  for (std::size_t i = 0; i < items.size(); ++i)
    if (i == 0 || !items[i].follows) borders.push_back(i);
  borders.push_back(items.size());
  return borders;
}

/// Whether two layers' blocks may be sampled together: at the same places, of samples of the same kind.
bool sampled_alike(const WorkItem& a, const WorkItem& b) {
  return a.source->type() == b.source->type() && a.source->bands().size() == b.source->bands().size() &&
         a.source->domain() == b.source->domain() && a.stride_px == b.stride_px && same_places(*a.block, *b.block);
}

}  // namespace

std::vector<WorkItem> in_groups(std::span<const std::vector<WorkItem>> layers) {
  std::vector<WorkItem> items;
  std::vector<bool> done(layers.size());
  for (std::size_t k = 0; k < layers.size(); ++k) {
    if (done[k]) continue;
    for (std::size_t i = 0; i < layers[k].size(); ++i) {
      std::size_t first = items.size();
      for (std::size_t other = k; other < layers.size(); ++other) {
        if (layers[other].size() != layers[k].size()) continue;
        done[other] = true;
        items.push_back(layers[other][i]);
        items.back().follows = other > k && sampled_alike(items[first], items.back());
        if (!items.back().follows) first = items.size() - 1;
      }
    }
    done[k] = true;
  }
  return items;
}

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
    const std::vector<std::size_t> borders = group_borders(items);
    counters.blocks_shared += static_cast<std::int64_t>(items.size() - (borders.size() - 1));
    tbb::parallel_for(std::size_t{0}, borders.size() - 1, [&](std::size_t i) {
      sample(items.subspan(borders[i], borders[i + 1] - borders[i]), {wanted, *pinned});
    });
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

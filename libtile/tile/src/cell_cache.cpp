#include "nadir/tile/cell_cache.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include "nadir/base/text.h"

namespace nadir::tile {

Result<CellPtr> CellCache::get(const CellSource& source, int level, std::int32_t col, std::int32_t row) {
  const CellKey key{source.id(), level, col, row};
  const std::uint64_t bytes = source.cell_bytes();
  {
    std::unique_lock lock(mutex_);
    for (;;) {
      const auto it = slots_.find(key);
      if (it == slots_.end()) break;
      if (it->second.cell) {
        ++counters_.hits;
        by_age_.splice(by_age_.begin(), by_age_, it->second.age);
        return it->second.cell;
      }
      loaded_.wait(lock);  // another thread reads it; should that fail, the loop ends and this one tries
    }
    if (!make_room(bytes))
      return fail(
          Error::Kind::OverBudget,
          fmt::format("{}: the tile cache of {} is full of tiles in use; allow more memory, or render smaller frames",
                      source.map().description().path, format_bytes(budget_bytes_)));
    counters_.bytes += bytes;
    counters_.peak_bytes = std::max(counters_.peak_bytes, counters_.bytes);
    ++counters_.loads;
    slots_.emplace(key, Slot{nullptr, bytes, {}});
  }

  // Isolated, because a worker that waits inside load may pick up another render task; were that task to ask for this
  // cell, it would wait for itself.
  auto cell = tbb::this_task_arena::isolate([&] { return source.load(level, col, row); });

  std::scoped_lock lock(mutex_);
  const auto it = slots_.find(key);
  if (cell) {
    it->second.cell = *cell;
    by_age_.push_front(key);
    it->second.age = by_age_.begin();
  } else {  // told to this caller; those who waited try for themselves
    counters_.bytes -= bytes;
    slots_.erase(it);
  }
  loaded_.notify_all();
  return cell;
}

bool CellCache::make_room(std::uint64_t bytes) {
  for (auto oldest = by_age_.end(); counters_.bytes + bytes > budget_bytes_ && oldest != by_age_.begin();) {
    --oldest;
    const auto slot = slots_.find(*oldest);
    if (slot->second.cell.use_count() > 1) continue;  // pinned
    counters_.bytes -= slot->second.bytes;
    ++counters_.evictions;
    slots_.erase(slot);
    oldest = by_age_.erase(oldest);
  }
  return counters_.bytes + bytes <= budget_bytes_;
}

CacheCounters CellCache::counters() const {
  std::scoped_lock lock(mutex_);
  return counters_;
}

}  // namespace nadir::tile

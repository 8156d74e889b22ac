#pragma once

#include <condition_variable>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>

#include "nadir/base/result.h"
#include "nadir/tile/cell.h"
#include "nadir/tile/cell_source.h"

namespace nadir::tile {

struct CacheCounters {
  std::int64_t hits = 0, loads = 0, evictions = 0;
  std::uint64_t bytes = 0, peak_bytes = 0;  // held, pinned cells included
};

/// Cells of any sources, within a hard byte budget that includes the pinned ones.
///
/// A cell is loaded once however many threads ask for it, and no lock is held over reading. A cell that somebody holds
/// is pinned: it is never evicted. Of the others the least recently used goes first.
/// Thread-safe.
class CellCache {
 public:
  explicit CellCache(std::uint64_t budget_bytes) : budget_bytes_(budget_bytes) {}

  /// The cell, loaded where it is not held. Error::OverBudget where pinned cells leave no room for it.
  Result<CellPtr> get(const CellSource& source, int level, std::int32_t col, std::int32_t row);

  std::uint64_t budget_bytes() const { return budget_bytes_; }
  CacheCounters counters() const;

 private:
  struct Slot {
    CellPtr cell;  // empty while one thread loads it
    std::uint64_t bytes = 0;
    std::list<CellKey>::iterator age;
  };
  bool make_room(std::uint64_t bytes);  // with mutex_ held

  const std::uint64_t budget_bytes_;
  mutable std::mutex mutex_;  // guards what follows; never held while a cell is read
  std::condition_variable loaded_;
  std::map<CellKey, Slot> slots_;
  std::list<CellKey> by_age_;  // most recently used first; loaded cells only
  CacheCounters counters_;
};

}  // namespace nadir::tile

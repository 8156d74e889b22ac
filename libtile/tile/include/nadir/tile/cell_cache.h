#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/tile/cell.h"
#include "nadir/tile/cell_source.h"

namespace nadir::tile {

struct CacheCounters {
  std::int64_t hits = 0;                                // cells that were there when asked for
  std::int64_t loads = 0;                               // cells brought in, asked for or not
  std::int64_t blocks_loaded = 0;                       // stored tiles decoded for them
  std::int64_t evictions = 0;                           // cells
  std::int64_t prefetched = 0, prefetch_cancelled = 0;  // blocks
  std::uint64_t bytes = 0, peak_bytes = 0;              // held, pinned cells and those being loaded included
};

/// A cell that somebody wants.
struct CellRequest {
  const CellSource* source = nullptr;
  std::int32_t level = 0, col = 0, row = 0;
};

/// Cells of any sources, within a hard byte budget that includes the pinned ones and those being loaded.
///
/// Cells come in blocks, since a stored tile holds many: all of a block's are kept where the budget has room for them,
/// else those asked for alone. A block is loaded once however many threads ask for it, and no lock is held over reading
/// or decoding. A cell that somebody holds is pinned: it is never evicted. Of the others, blocks that were asked for
/// only once go first, so that a flight over much ground does not displace what is used again and again.
/// Thread-safe.
class CellCache {
 public:
  /// `threads`: for decoding, apart from those that sample; 0: as many as the machine has.
  explicit CellCache(std::uint64_t budget_bytes, int threads = 0);
  ~CellCache();
  CellCache(const CellCache&) = delete;
  CellCache& operator=(const CellCache&) = delete;

  /// The cell, loaded where it is not held. Error::OverBudget where pinned cells leave no room for it. A cell of a
  /// damaged tile is there, all invalid, and says so: Cell::damage.
  Result<CellPtr> get(const CellSource& source, int level, std::int32_t col, std::int32_t row);

  /// All of `requests`, in their order: blocks that are far away are fetched together, decoded side by side. Where
  /// several fail, the error of the first in order.
  Result<std::vector<CellPtr>> pin(std::span<const CellRequest> requests);

  /// Those of `requests` that are in memory, in their order, null where they are not: reads nothing and waits for
  /// nobody's reading. They count as used.
  std::vector<CellPtr> held(std::span<const CellRequest> requests);

  /// What `prefetch` was asked for. Destroyed, it cancels what of that has not begun.
  class Ticket {
   public:
    Ticket() = default;
    ~Ticket() { cancel(); }
    Ticket(Ticket&&) noexcept = default;
    Ticket& operator=(Ticket&& other) noexcept {
      cancel();
      cancelled_ = std::move(other.cancelled_);
      return *this;
    }
    void cancel() {
      if (cancelled_) *cancelled_ = true;
    }

   private:
    friend class CellCache;
    std::shared_ptr<std::atomic<bool>> cancelled_;
  };

  /// Loads the blocks of `requests` in the background, those of higher priority first, each only where it displaces
  /// nothing that is pinned or was used again. Errors are not told: whoever needs the cell meets them.
  [[nodiscard]] Ticket prefetch(std::span<const CellRequest> requests, int priority = 0);
  /// Waits until nothing that was asked of `prefetch` is left to do.
  void wait_for_prefetch();

  std::uint64_t budget_bytes() const;
  CacheCounters counters() const;

 private:
  struct Engine;
  std::unique_ptr<Engine> engine_;
};

}  // namespace nadir::tile

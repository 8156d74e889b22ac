#include "nadir/tile/cell_cache.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/spin_mutex.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <list>
#include <mutex>
#include <optional>
#include <queue>
#include <thread>
#include <unordered_map>

#include "nadir/base/text.h"

namespace nadir::tile {
namespace {

/// Address of a block: its first cell.
using BlockKey = CellKey;

struct HashKey {
  std::size_t operator()(const BlockKey& key) const {
    // Multiplications by odd constants spread neighbours over all bits (Knuth, volume 3, section 6.4).
    std::uint64_t h = key.source * 0x9e3779b97f4a7c15ull;
    h = (h ^ static_cast<std::uint32_t>(key.level)) * 0xbf58476d1ce4e5b9ull;
    h = (h ^ static_cast<std::uint32_t>(key.col)) * 0x94d049bb133111ebull;
    h = (h ^ static_cast<std::uint32_t>(key.row)) * 0x9e3779b97f4a7c15ull;
    return h ^ (h >> 29);
  }
};

/// The cells of one block that are wanted together.
struct Group {
  const CellSource* source = nullptr;
  CellBlock block;
  std::vector<std::uint8_t> wanted;   // of the block's cells
  std::vector<std::size_t> requests;  // indices of who wants them
  BlockKey key() const { return {source->id(), block.level, block.col, block.row}; }
};

std::vector<Group> grouped(std::span<const CellRequest> requests) {
  std::vector<Group> groups;
  std::unordered_map<BlockKey, std::size_t, HashKey> index;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const CellRequest& r = requests[i];
    const CellBlock block = r.source->block_of(r.level, r.col, r.row);
    const auto [it, first] =
        index.try_emplace(BlockKey{r.source->id(), block.level, block.col, block.row}, groups.size());
    if (first) groups.push_back({r.source, block, std::vector<std::uint8_t>(block.size(), 0), {}});
    Group& group = groups[it->second];
    group.wanted[block.index(r.col, r.row)] = 1;
    group.requests.push_back(i);
  }
  return groups;
}

/// Brings what of the groups in `batch` is far away: for each its bytes, or null where it is to be read in place.
std::vector<Result<std::shared_ptr<const FetchedBlock>>> fetch(const std::vector<Group>& groups,
                                                               std::span<const std::size_t> batch) {
  std::vector<Result<std::shared_ptr<const FetchedBlock>>> fetched(batch.size(), nullptr);
  std::vector<const CellSource*> far;
  for (const std::size_t g : batch)
    if (groups[g].source->is_remote() && std::find(far.begin(), far.end(), groups[g].source) == far.end())
      far.push_back(groups[g].source);
  for (const CellSource* source : far) {
    std::vector<CellBlock> blocks;
    std::vector<std::size_t> of;
    for (std::size_t m = 0; m < batch.size(); ++m) {
      if (groups[batch[m]].source != source) continue;
      blocks.push_back(groups[batch[m]].block);
      of.push_back(m);
    }
    auto brought = source->fetch(blocks);
    for (std::size_t b = 0; b < blocks.size(); ++b) fetched[of[b]] = std::move(brought[b]);
  }
  return fetched;
}

}  // namespace

struct CellCache::Engine {
  Engine(std::uint64_t budget, int threads)
      : budget_bytes(budget), arena(threads > 0 ? threads : tbb::task_arena::automatic) {}

  struct Entry {
    std::vector<std::shared_ptr<Cell>> cells;  // of the block; null where not kept; empty while being loaded
    std::uint64_t cell_bytes = 0;
    bool loading = false, used_again = false;
    std::uint64_t turn = 0;  // of the last use
    std::list<BlockKey>::iterator age;
  };
  struct alignas(128) Shard {  // two lines: processors fetch them in pairs
    tbb::spin_mutex mutex;     // guards what follows; held for moments, never while a block is read
    std::condition_variable_any loaded;
    std::unordered_map<BlockKey, Entry, HashKey> entries;
    std::list<BlockKey> once, again;  // by age, last used first: asked for once, and more than once
    CacheCounters counters;
  };

  const std::uint64_t budget_bytes;
  std::array<Shard, 64> shards;
  alignas(128) std::atomic<std::uint64_t> turn{1};  // counts calls of `pin` and loads: uses in between are one
  std::atomic<std::uint64_t> bytes{0}, peak_bytes{0}, again_bytes{0};  // the last, of what was used again
  tbb::task_arena arena;  // where blocks are decoded, so that they never wait for, or hold up, those who sample

  // Prefetching
  struct Job {
    int priority;
    std::uint64_t order;
    Group group;
    std::shared_ptr<const CellSource> source;  // lives until the job is done
    std::shared_ptr<std::atomic<bool>> cancelled;
    friend bool operator<(const Job& a, const Job& b) {
      return a.priority != b.priority ? a.priority < b.priority : a.order > b.order;
    }
  };
  std::mutex jobs_mutex;  // guards what follows
  std::condition_variable jobs_changed;
  std::priority_queue<Job> jobs;
  std::uint64_t jobs_so_far = 0;
  bool busy = false, closing = false;
  std::atomic<std::int64_t> prefetched{0}, prefetch_cancelled{0};
  std::thread worker;

  Shard& shard_of(const BlockKey& key) { return shards[HashKey()(key) % shards.size()]; }

  static std::uint64_t held_bytes(const Entry& entry) {
    const auto held = std::count_if(entry.cells.begin(), entry.cells.end(), [](const auto& c) { return c != nullptr; });
    return static_cast<std::uint64_t>(held) * entry.cell_bytes;
  }

  bool try_reserve(std::uint64_t wanted) {
    std::uint64_t now = bytes.load(std::memory_order_relaxed);
    do {
      if (wanted > budget_bytes || now > budget_bytes - wanted) return false;
    } while (!bytes.compare_exchange_weak(now, now + wanted));
    std::uint64_t peak = peak_bytes.load(std::memory_order_relaxed);
    while (peak < now + wanted && !peak_bytes.compare_exchange_weak(peak, now + wanted)) {
    }
    return true;
  }

  /// Drops the cells of the oldest block of a list that nobody holds. With the shard's mutex held. False where the list
  /// has none.
  bool evict_one(Shard& shard, std::list<BlockKey>& ages) {
    for (auto next = ages.end(); next != ages.begin();) {
      const auto oldest = std::prev(next);
      next = oldest;
      const auto it = shard.entries.find(*oldest);
      Entry& entry = it->second;
      if (entry.loading) continue;  // more of its cells are on their way
      std::uint64_t freed = 0;
      bool held = false;
      for (auto& cell : entry.cells) {
        if (!cell) continue;
        if (cell.use_count() > 1) {
          held = true;
          continue;
        }
        cell.reset();
        freed += entry.cell_bytes;
        ++shard.counters.evictions;
      }
      if (entry.used_again) again_bytes -= freed;
      if (!held) {
        next = ages.erase(oldest);
        shard.entries.erase(it);
      }
      bytes -= freed;
      if (freed > 0) return true;
    }
    return false;
  }

  /// Reserves bytes, evicting what nobody holds; `gently`: only what was asked for no more than once.
  bool make_room(std::uint64_t wanted, std::size_t first_shard, bool gently) {
    if (wanted > budget_bytes) return false;
    for (const bool used_again : {false, true}) {
      if (used_again && gently) break;
      for (std::size_t i = 0; i < shards.size(); ++i) {
        if (try_reserve(wanted)) return true;
        Shard& shard = shards[(first_shard + i) % shards.size()];
        for (;;) {
          {
            const std::scoped_lock lock(shard.mutex);
            if (!evict_one(shard, used_again ? shard.again : shard.once)) break;
          }
          if (try_reserve(wanted)) return true;
        }
      }
    }
    return try_reserve(wanted);
  }

  /// Notes that a block was used; with the shard's mutex held. Once a turn, so that lookups between write nothing that
  /// other threads read.
  void touch(Shard& shard, Entry& entry) {
    const std::uint64_t now = turn.load(std::memory_order_relaxed);
    if (entry.turn == now) return;
    entry.turn = now;
    if (entry.used_again) {
      shard.again.splice(shard.again.begin(), shard.again, entry.age);
      return;
    }
    entry.used_again = true;
    shard.again.splice(shard.again.begin(), shard.once, entry.age);
    again_bytes += held_bytes(entry);
    // What was used again keeps four fifths at most: a working set that has moved on must give way.
    while (again_bytes > budget_bytes / 5 * 4 && shard.again.size() > 1) {
      Entry& oldest = shard.entries.find(shard.again.back())->second;
      oldest.used_again = false;
      again_bytes -= held_bytes(oldest);
      shard.once.splice(shard.once.begin(), shard.again, oldest.age);
    }
  }

  /// The wanted cells of a block that is there; false where one is not.
  bool find(const Group& group, std::span<CellPtr> out) {
    Shard& shard = shard_of(group.key());
    const std::scoped_lock lock(shard.mutex);
    const auto it = shard.entries.find(group.key());
    return it != shard.entries.end() && take(shard, it->second, group, out);
  }

  /// Whether all wanted cells are there. With the shard's mutex held.
  static bool holds(const Entry& entry, const Group& group) {
    if (entry.cells.empty()) return false;
    for (std::size_t i = 0; i < group.wanted.size(); ++i)
      if (group.wanted[i] && !entry.cells[i]) return false;
    return true;
  }

  /// With the shard's mutex held.
  bool take(Shard& shard, Entry& entry, const Group& group, std::span<CellPtr> out) {
    if (!holds(entry, group)) return false;
    std::int64_t taken = 0;
    for (std::size_t i = 0; i < group.wanted.size(); ++i) {
      if (!group.wanted[i]) continue;
      out[i] = entry.cells[i];
      ++taken;
    }
    shard.counters.hits += taken;
    touch(shard, entry);
    return true;
  }

  /// What there is of the wanted cells of a block.
  void find_some(const Group& group, std::span<CellPtr> out) {
    Shard& shard = shard_of(group.key());
    const std::scoped_lock lock(shard.mutex);
    const auto it = shard.entries.find(group.key());
    if (it == shard.entries.end() || it->second.cells.empty()) return;
    Group there = group;
    for (std::size_t i = 0; i < there.wanted.size(); ++i) there.wanted[i] &= it->second.cells[i] != nullptr;
    if (std::count(there.wanted.begin(), there.wanted.end(), 1) > 0) take(shard, it->second, there, out);
  }

  using Fetched = Result<std::shared_ptr<const FetchedBlock>>;

  /// Loads a block, or waits for who does, and takes its wanted cells. `fetched`: what was brought of it, null inside
  /// where it is to be read now.
  Result<void> load(const Group& group, const Fetched& fetched, bool prefetching, std::span<CellPtr> out) {
    const BlockKey key = group.key();
    Shard& shard = shard_of(key);
    turn.fetch_add(1, std::memory_order_relaxed);
    {
      std::unique_lock<tbb::spin_mutex> lock(shard.mutex);
      for (;;) {
        Entry& entry = shard.entries.try_emplace(key).first->second;
        if (!entry.loading) {
          if (take(shard, entry, group, out)) return {};
          entry.loading = true;
          break;
        }
        shard.loaded.wait(lock);  // should it fail, the loop comes round and this one tries
      }
    }

    // Room for all of the block, or for what is wanted of it
    const std::uint64_t cell_bytes = group.source->cell_bytes();
    const auto wanted_cells = static_cast<std::uint64_t>(std::count(group.wanted.begin(), group.wanted.end(), 1));
    const std::size_t index = static_cast<std::size_t>(&shard - shards.data());
    std::span<const std::uint8_t> wanted;
    std::uint64_t reserved = group.block.size() * cell_bytes;
    bool room = make_room(reserved, index, prefetching);
    if (!room && !prefetching) {
      wanted = group.wanted;
      reserved = wanted_cells * cell_bytes;
      room = make_room(reserved, index, false);
    }
    Result<std::vector<std::shared_ptr<Cell>>> cells = fail(
        Error::Kind::OverBudget,
        fmt::format("{}: the tile cache of {} is full of tiles in use; allow more memory, or render smaller frames",
                    group.source->map().description().path, format_bytes(budget_bytes)));
    if (room) {
      // Isolated, because a worker that waits inside load may pick up another task; were that task to ask for this
      // block, it would wait for itself.
      cells = tbb::this_task_arena::isolate([&]() -> Result<std::vector<std::shared_ptr<Cell>>> {
        if (!fetched) return fail(fetched);
        return group.source->load(group.block, wanted, fetched->get());
      });
      if (!cells && cells.error().kind == Error::Kind::Damaged)
        cells = group.source->damaged(group.block, wanted, cells.error().message);
    }

    const std::scoped_lock lock(shard.mutex);
    const auto it = shard.entries.find(key);
    Entry& entry = it->second;
    entry.loading = false;
    shard.loaded.notify_all();
    if (!cells) {
      if (room) bytes -= reserved;
      if (entry.cells.empty()) shard.entries.erase(it);
      return tl::unexpected(cells.error());
    }
    ++shard.counters.blocks_loaded;
    const bool first = entry.cells.empty();
    if (first) {
      entry.cells.resize(group.block.size());
      entry.cell_bytes = cell_bytes;
      shard.once.push_front(key);
      entry.age = shard.once.begin();
      entry.turn = turn.load(std::memory_order_relaxed);
    }
    // Cells that somebody holds stay: they are the same
    std::uint64_t kept = 0;
    for (std::size_t i = 0; i < entry.cells.size(); ++i) {
      if (entry.cells[i] || !(*cells)[i]) continue;
      entry.cells[i] = std::move((*cells)[i]);
      kept += cell_bytes;
      ++shard.counters.loads;
    }
    if (entry.used_again) again_bytes += kept;
    bytes -= reserved - kept;
    for (std::size_t i = 0; i < group.wanted.size() && !out.empty(); ++i)
      if (group.wanted[i]) out[i] = entry.cells[i];
    return {};
  }

  void work() {
    std::unique_lock lock(jobs_mutex);
    for (;;) {
      jobs_changed.wait(lock, [&] { return closing || !jobs.empty(); });
      if (closing) return;
      const Job job = jobs.top();
      jobs.pop();
      busy = true;
      lock.unlock();
      if (*job.cancelled)
        ++prefetch_cancelled;
      else
        prefetch_one(job.group);
      lock.lock();
      busy = false;
      jobs_changed.notify_all();
    }
  }

  void prefetch_one(const Group& group) {
    {
      Shard& shard = shard_of(group.key());
      const std::scoped_lock lock(shard.mutex);
      const auto it = shard.entries.find(group.key());
      if (it != shard.entries.end() && (it->second.loading || holds(it->second, group))) return;
    }
    std::vector<CellPtr> cells(group.block.size());
    if (load(group, nullptr, true, cells)) ++prefetched;
  }
};

CellCache::CellCache(std::uint64_t budget_bytes, int threads)
    : engine_(std::make_unique<Engine>(budget_bytes, threads)) {}

CellCache::~CellCache() {
  {
    const std::scoped_lock lock(engine_->jobs_mutex);
    engine_->closing = true;
  }
  engine_->jobs_changed.notify_all();
  if (engine_->worker.joinable()) engine_->worker.join();
}

Result<CellPtr> CellCache::get(const CellSource& source, int level, std::int32_t col, std::int32_t row) {
  const CellBlock block = source.block_of(level, col, row);
  const BlockKey key{source.id(), block.level, block.col, block.row};
  const std::size_t index = block.index(col, row);
  {
    Engine::Shard& shard = engine_->shard_of(key);
    const std::scoped_lock lock(shard.mutex);
    const auto it = shard.entries.find(key);
    if (it != shard.entries.end() && !it->second.cells.empty() && it->second.cells[index]) {
      ++shard.counters.hits;
      engine_->touch(shard, it->second);
      return CellPtr(it->second.cells[index]);
    }
  }
  const CellRequest request{&source, level, col, row};
  const std::vector<Group> groups = grouped({&request, 1});
  std::vector<CellPtr> cells(block.size());
  if (auto ok = engine_->load(groups.front(), nullptr, false, cells); !ok) return fail(ok);
  return cells[index];
}

Result<std::vector<CellPtr>> CellCache::pin(std::span<const CellRequest> requests) {
  const std::vector<Group> groups = grouped(requests);
  engine_->turn.fetch_add(1, std::memory_order_relaxed);
  std::vector<std::vector<CellPtr>> found(groups.size());
  std::vector<std::size_t> missing;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    found[g].resize(groups[g].block.size());
    if (!engine_->find(groups[g], found[g])) missing.push_back(g);
  }

  // What is far away comes together, in batches whose packed bytes stay small beside a budget
  for (auto first = missing.begin(); first != missing.end();) {
    constexpr std::uint64_t batch_bytes = 64 << 20;  // of cells
    std::uint64_t bytes = 0;
    auto last = first;
    for (; last != missing.end() && (bytes == 0 || bytes < batch_bytes); ++last)
      if (groups[*last].source->is_remote()) bytes += groups[*last].block.size() * groups[*last].source->cell_bytes();
    const std::span<const std::size_t> batch(&*first, static_cast<std::size_t>(last - first));
    auto fetched = fetch(groups, batch);

    std::vector<std::optional<Error>> errors(batch.size());
    const auto load = [&](std::size_t m) {
      if (auto ok = engine_->load(groups[batch[m]], fetched[m], false, found[batch[m]]); !ok) errors[m] = ok.error();
      fetched[m] = nullptr;
    };
    if (batch.size() == 1)
      load(0);
    else
      engine_->arena.execute([&] { tbb::parallel_for(std::size_t{0}, batch.size(), load); });
    for (std::size_t m = 0; m < batch.size(); ++m) {
      // Whole blocks that were on their way, of this call and ahead of the next, may have taken the room: alone, when
      // they have come, it fits where what is wanted does
      if (errors[m] && errors[m]->kind == Error::Kind::OverBudget) {
        wait_for_prefetch();
        errors[m].reset();
        load(m);
      }
      if (errors[m]) return tl::unexpected(*errors[m]);
    }
    first = last;
  }

  std::vector<CellPtr> cells(requests.size());
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const std::size_t i : groups[g].requests)
      cells[i] = found[g][groups[g].block.index(requests[i].col, requests[i].row)];
  return cells;
}

std::vector<CellPtr> CellCache::held(std::span<const CellRequest> requests) {
  engine_->turn.fetch_add(1, std::memory_order_relaxed);
  std::vector<CellPtr> cells(requests.size());
  std::vector<CellPtr> found;
  for (const Group& group : grouped(requests)) {
    found.assign(group.block.size(), nullptr);
    engine_->find_some(group, found);
    for (const std::size_t i : group.requests) cells[i] = found[group.block.index(requests[i].col, requests[i].row)];
  }
  return cells;
}

CellCache::Ticket CellCache::prefetch(std::span<const CellRequest> requests, int priority) {
  Ticket ticket;
  ticket.cancelled_ = std::make_shared<std::atomic<bool>>(false);
  {
    const std::scoped_lock lock(engine_->jobs_mutex);
    for (Group& group : grouped(requests)) {
      auto source = group.source->shared_from_this();
      engine_->jobs.push({priority, engine_->jobs_so_far++, std::move(group), std::move(source), ticket.cancelled_});
    }
    if (!engine_->worker.joinable()) engine_->worker = std::thread([engine = engine_.get()] { engine->work(); });
  }
  engine_->jobs_changed.notify_all();
  return ticket;
}

void CellCache::wait_for_prefetch() {
  std::unique_lock lock(engine_->jobs_mutex);
  engine_->jobs_changed.wait(lock, [&] { return engine_->jobs.empty() && !engine_->busy; });
}

std::uint64_t CellCache::budget_bytes() const { return engine_->budget_bytes; }

CacheCounters CellCache::counters() const {
  CacheCounters sum;
  for (Engine::Shard& shard : engine_->shards) {
    const std::scoped_lock lock(shard.mutex);
    sum.hits += shard.counters.hits;
    sum.loads += shard.counters.loads;
    sum.blocks_loaded += shard.counters.blocks_loaded;
    sum.evictions += shard.counters.evictions;
  }
  sum.prefetched = engine_->prefetched;
  sum.prefetch_cancelled = engine_->prefetch_cancelled;
  sum.bytes = engine_->bytes;
  sum.peak_bytes = engine_->peak_bytes;
  return sum;
}

}  // namespace nadir::tile

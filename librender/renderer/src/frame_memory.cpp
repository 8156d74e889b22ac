#include "nadir/render/frame_memory.h"

#include <algorithm>
#include <cstring>
#include <new>

namespace nadir::render {
namespace {

constexpr std::align_val_t alignment{64};  // of a cache line, and of the widest vectors

/// Smaller blocks are cleared before they are given anew, though nobody needs their zeros: that brings them to the
/// caches in one run. A frame that is written into memory which caches have lost waits for one line after the other:
/// a quarter of a frame of 640 x 480 in draft. Of larger ones the first lines are lost again before they are written.
constexpr std::size_t fetched_bytes = 4u << 20;

}  // namespace

FrameMemory::~FrameMemory() {
  while (!spare_.empty()) forget_first();
}

void* FrameMemory::take(std::size_t bytes) {
  void* memory = take_spare(bytes);
  const bool recycled = memory != nullptr;
  if (!recycled)
    memory = ::operator new(bytes, alignment);
  else if (bytes <= fetched_bytes)
    std::memset(memory, 0, bytes);
  const std::scoped_lock lock(mutex_);
  ++counters_.blocks_taken;
  counters_.blocks_recycled += recycled;
  counters_.used_bytes += bytes;
  counters_.peak_bytes = std::max(counters_.peak_bytes, counters_.used_bytes + counters_.spare_bytes);
  return memory;
}

/// The last one of its size that was given back, which caches may still hold; null where there is none.
void* FrameMemory::take_spare(std::size_t bytes) {
  const std::scoped_lock lock(mutex_);
  const auto found = std::find_if(spare_.rbegin(), spare_.rend(), [&](const Block& b) { return b.bytes == bytes; });
  if (found == spare_.rend()) return nullptr;
  void* const memory = found->memory;
  spare_.erase(std::next(found).base());
  counters_.spare_bytes -= bytes;
  return memory;
}

void FrameMemory::give_back(void* memory, std::size_t bytes) noexcept {
  const std::scoped_lock lock(mutex_);
  counters_.used_bytes -= bytes;
  if (bytes > most_spare_bytes_) return ::operator delete(memory, alignment);
  while (counters_.spare_bytes + bytes > most_spare_bytes_) forget_first();
  try {
    spare_.push_back({memory, bytes});
  } catch (const std::bad_alloc&) {
    return ::operator delete(memory, alignment);
  }
  counters_.spare_bytes += bytes;
}

void FrameMemory::forget_first() {
  ::operator delete(spare_.front().memory, alignment);
  counters_.spare_bytes -= spare_.front().bytes;
  spare_.pop_front();
}

FrameMemoryCounters FrameMemory::counters() const {
  const std::scoped_lock lock(mutex_);
  return counters_;
}

}  // namespace nadir::render

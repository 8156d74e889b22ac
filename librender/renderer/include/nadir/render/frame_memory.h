#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace nadir::render {

struct FrameMemoryCounters {
  std::uint64_t used_bytes = 0;                        // of frames that live
  std::uint64_t spare_bytes = 0;                       // of frames that are gone, kept
  std::uint64_t peak_bytes = 0;                        // the most of both together
  std::int64_t blocks_taken = 0, blocks_recycled = 0;  // recycled ones among those taken
};

/// Pixels of frames that are gone, kept for frames to come: a frame of the same size then takes no new pages from the
/// system, which cost more than writing them does.
/// Thread-safe. It never keeps more than its bound; those that were given back first go first.
class FrameMemory {
 public:
  explicit FrameMemory(std::uint64_t most_spare_bytes) : most_spare_bytes_(most_spare_bytes) {}
  ~FrameMemory();
  FrameMemory(const FrameMemory&) = delete;
  FrameMemory& operator=(const FrameMemory&) = delete;

  /// `bytes` of memory, which holds anything, for vectors of the widest registers.
  void* take(std::size_t bytes);
  /// What `take` gave for so many bytes.
  void give_back(void* memory, std::size_t bytes) noexcept;
  FrameMemoryCounters counters() const;

 private:
  struct Block {
    void* memory;
    std::size_t bytes;
  };
  void* take_spare(std::size_t bytes);
  void forget_first();

  const std::uint64_t most_spare_bytes_;
  mutable std::mutex mutex_;  // guards all below
  std::deque<Block> spare_;   // in the order in which they were given back
  FrameMemoryCounters counters_;
};

/// Takes memory from a renderer's frames that are gone; by default from the system. What it makes without a value
/// holds anything. The frames that hold it keep the FrameMemory alive.
template <class T>
class FrameAllocator {
 public:
  using value_type = T;
  using propagate_on_container_copy_assignment = std::true_type;
  using propagate_on_container_move_assignment = std::true_type;
  using propagate_on_container_swap = std::true_type;
  using is_always_equal = std::false_type;

  FrameAllocator() = default;
  explicit FrameAllocator(std::shared_ptr<FrameMemory> memory) : memory_(std::move(memory)) {}
  template <class U>
  FrameAllocator(const FrameAllocator<U>& other) : memory_(other.memory()) {}

  T* allocate(std::size_t count) {
    return memory_ ? static_cast<T*>(memory_->take(count * sizeof(T))) : std::allocator<T>().allocate(count);
  }
  void deallocate(T* at, std::size_t count) noexcept {
    memory_ ? memory_->give_back(at, count * sizeof(T)) : std::allocator<T>().deallocate(at, count);
  }
  template <class U>
  void construct(U* at) {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Values>
  void construct(U* at, Values&&... values) {
    ::new (static_cast<void*>(at)) U(std::forward<Values>(values)...);
  }

  const std::shared_ptr<FrameMemory>& memory() const { return memory_; }
  template <class U>
  friend bool operator==(const FrameAllocator& a, const FrameAllocator<U>& b) {
    return a.memory() == b.memory();
  }

 private:
  std::shared_ptr<FrameMemory> memory_;
};

/// A vector whose memory a Renderer's later frames take over.
template <class T>
using FrameBuffer = std::vector<T, FrameAllocator<T>>;

template <class T>
bool operator==(const FrameBuffer<T>& a, const std::vector<T>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

}  // namespace nadir::render

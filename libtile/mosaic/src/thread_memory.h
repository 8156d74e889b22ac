#pragma once

#include <vector>

namespace nadir::mosaic {

/// While in scope, a thread works in memory that it keeps for its next block, except what only a rare one needs.
template <class T>
class ThreadMemory {
 public:
  explicit ThreadMemory(std::vector<T>& memory) : memory_(memory) {}
  ~ThreadMemory() {
    constexpr std::size_t most_kept_bytes = 16 << 20;
    if (memory_.capacity() * sizeof(T) > most_kept_bytes) std::vector<T>().swap(memory_);
  }
  ThreadMemory(const ThreadMemory&) = delete;
  ThreadMemory& operator=(const ThreadMemory&) = delete;

 private:
  std::vector<T>& memory_;
};

}  // namespace nadir::mosaic

#include "allocations.h"

#include <cstddef>
#include <cstdlib>
#include <new>

namespace nadir::bench {
namespace {
thread_local std::int64_t count = 0;
}
std::int64_t allocations() { return count; }

namespace {
void* allocate(std::size_t size, std::size_t alignment) {
  ++count;
  void* memory = alignment <= alignof(std::max_align_t)
                     ? std::malloc(size)
                     : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (!memory) throw std::bad_alloc();
  return memory;
}
}  // namespace
}  // namespace nadir::bench

// In the place of the library's own. Its other forms of new call these.
void* operator new(std::size_t size) { return nadir::bench::allocate(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return nadir::bench::allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

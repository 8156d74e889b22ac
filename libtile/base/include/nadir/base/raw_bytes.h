#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace nadir {

/// Leaves what it makes as memory is found, where nothing else is said.
template <class T>
struct UninitializedAllocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = UninitializedAllocator<U>;
  };
  template <class U>
  void construct(U* at) noexcept {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Args>
  void construct(U* at, Args&&... args) {
    ::new (static_cast<void*>(at)) U(std::forward<Args>(args)...);
  }
};

/// Bytes to be written by others: growing leaves the new ones undefined.
using RawBytes = std::vector<std::byte, UninitializedAllocator<std::byte>>;

}  // namespace nadir

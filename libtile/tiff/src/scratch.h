#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace nadir::tiff {

/// Memory that a thread packs or unpacks in. Not initialised: whatever is read from it was written before.
class Scratch {
 public:
  std::span<std::byte> take(std::size_t bytes) {
    if (bytes > size_) {
      bytes_.reset(new std::byte[bytes]);
      size_ = bytes;
    }
    return {bytes_.get(), bytes};
  }
  /// Gives back what only a rare tile needs.
  void trim() {
    if (size_ <= most_kept_bytes) return;
    bytes_.reset();
    size_ = 0;
  }

 private:
  static constexpr std::size_t most_kept_bytes = 16 << 20;
  std::unique_ptr<std::byte[]> bytes_;
  std::size_t size_ = 0;
};

}  // namespace nadir::tiff

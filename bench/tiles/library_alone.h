#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::bench {

/// The packed tiles of a TIFF of one directory, in memory, and the codec's own library to unpack them: nothing between
/// the two but the call. Of LZW, which has no other, libtiff is the library, over the same bytes.
class LibraryAlone {
 public:
  static Result<std::unique_ptr<LibraryAlone>> open(const std::filesystem::path& path);
  virtual ~LibraryAlone() = default;

  std::size_t tiles() const { return tiles_.size(); }
  std::size_t tile_bytes() const { return tile_bytes_; }  // unpacked
  /// Unpacks tile `i` into `out`, tile_bytes() long. From several threads at once.
  virtual Result<void> unpack(std::size_t i, std::byte* out) const = 0;

 protected:
  std::vector<std::vector<std::byte>> tiles_;
  std::size_t tile_bytes_ = 0;
};

}  // namespace nadir::bench

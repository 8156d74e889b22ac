#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "builders.h"

namespace nadir::bench {

/// The codec's own library packing as many tiles as a pyramid has, from memory to memory: what no builder can beat on
/// so many threads. Predictors have been applied before.
class CodecAlone {
 public:
  /// Tiles of the square raster `source` (RGB, 8 bits): at most 256 spread over it, three quarters as they are and the
  /// others reduced as in levels 1 and 2; they stand for all.
  static Result<std::shared_ptr<CodecAlone>> make(const std::string& source, const BuildPacking& packing);

  /// Packs all. Io where the library cannot.
  Result<void> run();

  std::size_t tiles() const { return tiles_; }
  std::size_t packed_bytes() const { return packed_bytes_; }  // of the last run

 private:
  using Bytes = std::vector<unsigned char>;
  CodecAlone(const BuildPacking& packing, std::size_t tiles) : packing_(packing), tiles_(tiles) {}
  BuildPacking packing_;
  std::size_t tiles_ = 0, packed_bytes_ = 0;
  std::vector<Bytes> pool_;
};

}  // namespace nadir::bench

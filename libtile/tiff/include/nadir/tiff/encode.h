#pragma once

#include <cstddef>
#include <memory>

#include "nadir/base/raw_bytes.h"
#include "nadir/base/result.h"
#include "nadir/tiff/directory.h"

namespace nadir::tiff {

/// How hard and how exactly tiles are packed; each codec looks at what concerns it.
struct Packing {
  int level = 0;                 // DEFLATE 1 to 12, Zstandard 1 to 22, LZMA 0 to 9, LERC's own packing; 0: the usual
  int quality = 90;              // JPEG and WebP, 1 to 100; WebP loses nothing at 100
  bool subsample_chroma = true;  // JPEG of three bands: one sample of colour difference for 2 x 2 texels, else for each
  double max_error = 0;          // LERC, in stored units; 0 loses nothing
};

/// Packs tiles of one format. The same samples give the same bytes, on any thread.
/// Thread-safe.
class TileEncoder {
 public:
  /// Unsupported, with what the codec can hold, where it cannot hold such samples; Malformed where `packing` is out of
  /// range.
  static Result<TileEncoder> create(TileFormat format, const Packing& packing);

  /// As given, completed by what the codec decides: JPEG's shared tables and colour model, LERC's packing.
  const TileFormat& format() const;

  /// Packs a tile and appends it to `out`: tile_height rows, each of tile_width * samples_together() samples of type
  /// decoded_sample(), `stride` bytes from one to the next. Samples lie aligned for their type; rows may be those of a
  /// larger block. Its size in bytes.
  Result<std::size_t> append(const std::byte* first_row, std::size_t stride, RawBytes& out) const;

 private:
  struct State;
  explicit TileEncoder(std::shared_ptr<const State> state) : state_(std::move(state)) {}
  std::shared_ptr<const State> state_;
};

}  // namespace nadir::tiff

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "journal.h"
#include "nadir/mosaic/block.h"
#include "nadir/tiff/encode.h"

namespace nadir::pyramid {

/// Packs tiles and their masks as they lie in the file, each between its leader and its trailer.
/// Thread-safe.
class TilePacker {
 public:
  TilePacker(const TexelType& type, std::int32_t tile_size, tiff::TileEncoder imagery,
             std::optional<tiff::TileEncoder> mask)
      : type_(type), tile_size_(tile_size), imagery_(std::move(imagery)), mask_(std::move(mask)) {}

  /// Appends the tile that begins at the top left of `window` to `out`, and its mask; nothing where it is empty.
  /// What lies beyond the window repeats its last column and row, which packs well.
  Result<PackedSize> pack(const Block& block, const Window& window, RawBytes& out) const;

  const tiff::TileFormat& imagery_format() const { return imagery_.format(); }
  const tiff::TileFormat* mask_format() const { return mask_ ? &mask_->format() : nullptr; }

 private:
  Result<std::uint32_t> pack_imagery(const Block& block, const Window& window, RawBytes& out) const;
  Result<std::uint32_t> pack_mask(const Block& block, const Window& window, RawBytes& out) const;

  TexelType type_;
  std::int32_t tile_size_;
  tiff::TileEncoder imagery_;
  std::optional<tiff::TileEncoder> mask_;
};

}  // namespace nadir::pyramid

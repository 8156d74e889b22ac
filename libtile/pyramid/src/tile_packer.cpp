#include "tile_packer.h"

#include <algorithm>
#include <cstring>

#include "nadir/tiff/cog.h"

namespace nadir::pyramid {

Result<PackedSize> TilePacker::pack(const Block& block, const Window& window, RawBytes& out) const {
  PackedSize size;
  if (tells_holes(type_) && empty(type_, block, window)) return size;
  const auto imagery = pack_imagery(block, window, out);
  if (!imagery) return fail(imagery);
  size.imagery = *imagery;
  if (mask_) {
    const auto mask = pack_mask(block, window, out);
    if (!mask) return fail(mask);
    size.mask = *mask;
  }
  return size;
}

Result<std::uint32_t> TilePacker::pack_imagery(const Block& block, const Window& window, RawBytes& out) const {
  const std::size_t texel = type_.texel_bytes();
  const auto side = static_cast<std::size_t>(tile_size_);
  const std::byte* first = block.row(window.y) + static_cast<std::size_t>(window.x - block.window().x) * texel;
  std::size_t stride = block.row_bytes();
  if (window.width < tile_size_ || window.height < tile_size_) {
    static thread_local RawBytes padded;
    padded.resize(side * side * texel);
    const std::size_t there = static_cast<std::size_t>(window.width) * texel;
    for (std::size_t y = 0; y < side; ++y) {
      std::byte* to = padded.data() + y * side * texel;
      if (y >= static_cast<std::size_t>(window.height)) {
        std::memcpy(to, to - side * texel, side * texel);
        continue;
      }
      std::memcpy(to, first + y * stride, there);
      for (std::size_t at = there; at < side * texel; at += texel) std::memcpy(to + at, to + there - texel, texel);
    }
    first = padded.data();
    stride = side * texel;
  }
  return tiff::append_tile(imagery_, first, stride, out);
}

Result<std::uint32_t> TilePacker::pack_mask(const Block& block, const Window& window, RawBytes& out) const {
  const auto side = static_cast<std::size_t>(tile_size_);
  static thread_local std::vector<std::byte> bits;
  bits.assign(side * side, std::byte{0});
  for (std::int32_t y = 0; y < window.height; ++y) {
    const std::uint8_t* valid = block.valid_row(window.y + y) + (window.x - block.window().x);
    std::byte* to = bits.data() + static_cast<std::size_t>(y) * side;
    for (std::int32_t x = 0; x < window.width; ++x) to[x] = std::byte{valid[x] != 0};
  }
  return tiff::append_tile(*mask_, bits.data(), side, out);
}

}  // namespace nadir::pyramid

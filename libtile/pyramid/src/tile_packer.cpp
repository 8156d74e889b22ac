#include "tile_packer.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "nadir/tiff/cog.h"

namespace nadir::pyramid {
namespace {

std::uint32_t append(std::span<const std::byte> tile, std::vector<std::byte>& out) {
  const auto size = static_cast<std::uint32_t>(tile.size());
  const auto leader = std::as_bytes(std::span(&size, 1));
  out.insert(out.end(), leader.begin(), leader.end());
  out.insert(out.end(), tile.begin(), tile.end());
  // A tile of fewer bytes is led by zeros.
  std::array<std::byte, tiff::tile_trailer_bytes> trailer{};
  const std::size_t last = std::min(tile.size(), trailer.size());
  std::copy_n(tile.end() - static_cast<std::ptrdiff_t>(last), last, trailer.end() - static_cast<std::ptrdiff_t>(last));
  out.insert(out.end(), trailer.begin(), trailer.end());
  return size;
}

}  // namespace

Result<PackedSize> TilePacker::pack(const Block& block, const Window& window, std::vector<std::byte>& out) const {
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

Result<std::uint32_t> TilePacker::pack_imagery(const Block& block, const Window& window,
                                               std::vector<std::byte>& out) const {
  const std::size_t texel = type_.texel_bytes();
  const auto side = static_cast<std::size_t>(tile_size_);
  const std::byte* first = block.row(window.y) + static_cast<std::size_t>(window.x - block.window().x) * texel;
  std::size_t stride = block.row_bytes();
  if (window.width < tile_size_ || window.height < tile_size_) {
    static thread_local std::vector<std::byte> padded;
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
  const auto packed = imagery_.encode(first, stride);
  if (!packed) return fail(packed);
  return append(*packed, out);
}

Result<std::uint32_t> TilePacker::pack_mask(const Block& block, const Window& window,
                                            std::vector<std::byte>& out) const {
  const auto side = static_cast<std::size_t>(tile_size_);
  static thread_local std::vector<std::byte> bits;
  bits.assign(side * side, std::byte{0});
  for (std::int32_t y = 0; y < window.height; ++y) {
    const std::uint8_t* valid = block.valid_row(window.y + y) + (window.x - block.window().x);
    std::byte* to = bits.data() + static_cast<std::size_t>(y) * side;
    for (std::int32_t x = 0; x < window.width; ++x) to[x] = std::byte{valid[x] != 0};
  }
  const auto packed = mask_->encode(bits.data(), side);
  if (!packed) return fail(packed);
  return append(*packed, out);
}

}  // namespace nadir::pyramid

#include "block_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace nadir::mosaic {

BlockSource::BlockSource(const RasterHeader& header, const TexelType& type, int block_width, int block_height,
                         std::shared_ptr<Shared> shared)
    : file_(header.file),
      shared_(std::move(shared)),
      type_(type),
      block_width_(block_width),
      block_height_(block_height),
      number_(shared_->blocks.add_raster()) {
  description_ = header.description;
}

std::int64_t BlockSource::blocks() const { return across() * ((height() - 1) / block_height_ + 1); }

tl::unexpected<Error> BlockSource::damaged(const Window& window, const std::string& cause) const {
  return fail(Error::Kind::Damaged,
              fmt::format("{}: texels {} to {} by {} to {} cannot be read: {}; if the file is damaged, fetch or build "
                          "it again",
                          label(), window.x, std::int64_t{window.x} + window.width, window.y,
                          std::int64_t{window.y} + window.height, cause));
}

Result<std::shared_ptr<const Block>> BlockSource::get(std::int32_t col, std::int32_t row) const {
  const auto index = static_cast<std::uint64_t>(std::int64_t{row} * across() + col);
  return shared_->blocks.get(number_, index, [&](Block& block) {
    const std::int32_t x = col * block_width_, y = row * block_height_;
    block.reset(type_, {x, y, static_cast<std::int32_t>(std::min<std::int64_t>(block_width_, width() - x)),
                        static_cast<std::int32_t>(std::min<std::int64_t>(block_height_, height() - y))});
    decoded_.fetch_add(1, std::memory_order_relaxed);
    return decode(block);
  });
}

Result<void> BlockSource::read(Block& to) const {
  const Window& w = to.window();
  const std::int32_t right = w.x + w.width, bottom = w.y + w.height;
  for (std::int32_t row = w.y / block_height_; row * std::int64_t{block_height_} < bottom; ++row)
    for (std::int32_t col = w.x / block_width_; col * std::int64_t{block_width_} < right; ++col) {
      const auto block = get(col, row);
      if (!block) return fail(block);
      const Window& b = (*block)->window();
      const std::int32_t x = std::max(w.x, b.x), y = std::max(w.y, b.y);
      const auto texels = static_cast<std::size_t>(std::min(right, b.x + b.width) - x);
      const std::int32_t end = std::min(bottom, b.y + b.height);
      const std::size_t from = static_cast<std::size_t>(x - b.x), at = static_cast<std::size_t>(x - w.x),
                        texel = to.texel_bytes();
      for (std::int32_t line = y; line < end; ++line) {
        std::memcpy(to.row(line) + at * texel, (*block)->row(line) + from * texel, texels * texel);
        if (to.masked()) std::memcpy(to.valid_row(line) + at, (*block)->valid_row(line) + from, texels);
      }
    }
  return {};
}

}  // namespace nadir::mosaic

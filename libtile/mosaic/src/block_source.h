#pragma once

#include <atomic>

#include "readers.h"

namespace nadir::mosaic {

/// A raster that is decoded block by block, each kept as the map's texels.
class BlockSource : public Source {
 public:
  std::int64_t width() const override { return description_.levels.front().width; }
  std::int64_t height() const override { return description_.levels.front().height; }
  Window block() const override { return {0, 0, block_width_, block_height_}; }
  bool plain() const override { return false; }
  Result<void> read(Block& to) const override;
  std::int64_t blocks() const override;
  std::int64_t blocks_decoded() const override { return decoded_; }

 protected:
  BlockSource(const RasterHeader& header, const TexelType& type, int block_width, int block_height,
              std::shared_ptr<Shared> shared);

  /// Fills a block, whose window is set.
  virtual Result<void> decode(Block& block) const = 0;

  /// Damage of what is stored, with where it lies.
  tl::unexpected<Error> damaged(const Window& window, const std::string& cause) const;

  const SourceFile file_;
  const std::shared_ptr<Shared> shared_;

 private:
  std::int64_t across() const { return (width() - 1) / block_width_ + 1; }
  Result<std::shared_ptr<const Block>> get(std::int32_t col, std::int32_t row) const;

  const TexelType type_;
  const std::int32_t block_width_, block_height_;
  const std::uint32_t number_;  // in the cache
  mutable std::atomic<std::int64_t> decoded_{0};
};

}  // namespace nadir::mosaic

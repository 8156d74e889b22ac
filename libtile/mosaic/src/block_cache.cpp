#include "block_cache.h"

namespace nadir::mosaic {
namespace {

constexpr std::size_t most_spare = 4;

std::uint64_t bytes_of(const Block& block) {
  return std::uint64_t{block.texels()} * (block.texel_bytes() + (block.masked() ? 1 : 0));
}

}  // namespace

std::uint32_t BlockCache::add_raster() {
  const std::scoped_lock lock(mutex_);
  return rasters_++;
}

std::unique_ptr<Block> BlockCache::Spare::take() {
  const std::scoped_lock lock(mutex_);
  if (blocks_.empty()) return std::make_unique<Block>();
  std::unique_ptr<Block> block = std::move(blocks_.back());
  blocks_.pop_back();
  return block;
}

void BlockCache::Spare::give(std::unique_ptr<Block> block) {
  const std::scoped_lock lock(mutex_);
  if (blocks_.size() < most_spare) blocks_.push_back(std::move(block));
}

void BlockCache::keep(const Key& key, const BlockPtr& block) {
  const std::scoped_lock lock(mutex_);
  const auto it = slots_.find(key);
  used_.push_front(key);
  it->second.place = used_.begin();
  it->second.bytes = bytes_of(*block);
  held_bytes_ += it->second.bytes;
  while (held_bytes_ > limit_bytes_) {
    const auto oldest = slots_.find(used_.back());
    held_bytes_ -= oldest->second.bytes;
    slots_.erase(oldest);
    used_.pop_back();
  }
}

Result<std::shared_ptr<const Block>> BlockCache::get(std::uint32_t raster, std::uint64_t index, const Decode& decode) {
  const Key key{index, raster};
  std::promise<Result<BlockPtr>> promise;
  std::shared_future<Result<BlockPtr>> another_thread;
  {
    const std::scoped_lock lock(mutex_);
    if (const auto it = slots_.find(key); it != slots_.end()) {
      if (it->second.bytes > 0) used_.splice(used_.begin(), used_, it->second.place);
      another_thread = it->second.block;
    } else {
      slots_[key].block = promise.get_future().share();
    }
  }
  if (another_thread.valid()) {
    const Result<BlockPtr>& found = another_thread.get();
    if (!found) return fail(found);
    return std::shared_ptr<const Block>(*found);
  }

  const BlockPtr block(spare_->take().release(),
                       [spare = spare_](Block* b) { spare->give(std::unique_ptr<Block>(b)); });
  if (auto ok = decode(*block); !ok) {  // told to those who wait, then forgotten: the next one tries again
    promise.set_value(fail(ok));
    const std::scoped_lock lock(mutex_);
    slots_.erase(key);
    return fail(ok);
  }
  promise.set_value(block);
  keep(key, block);
  return std::shared_ptr<const Block>(block);
}

}  // namespace nadir::mosaic

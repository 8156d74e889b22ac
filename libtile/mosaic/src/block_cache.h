#pragma once

#include <cstdint>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/mosaic/block.h"

namespace nadir::mosaic {

/// Decoded blocks of many rasters, the last used of them.
/// Thread-safe. Each is decoded once, however many threads ask for it meanwhile; what callers hold beyond the limit is
/// theirs.
class BlockCache {
 public:
  explicit BlockCache(std::uint64_t limit_bytes) : limit_bytes_(limit_bytes) {}

  /// A number for the blocks of one raster.
  std::uint32_t add_raster();

  /// Fills a block of any window. Called unlocked; never calls the cache for a block that may wait for it.
  using Decode = std::function<Result<void>(Block&)>;

  /// The block `index` of `raster`. Waits while another thread decodes it.
  Result<std::shared_ptr<const Block>> get(std::uint32_t raster, std::uint64_t index, const Decode& decode);

 private:
  using BlockPtr = std::shared_ptr<Block>;
  struct Key {
    std::uint64_t index = 0;
    std::uint32_t raster = 0;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct Hash {
    std::size_t operator()(const Key& key) const {
      return static_cast<std::size_t>((key.index + (std::uint64_t{key.raster} << 40)) * 0x9e3779b97f4a7c15u >> 7);
    }
  };
  struct Slot {
    std::shared_future<Result<BlockPtr>> block;
    std::uint64_t bytes = 0;  // none while it is being decoded
    std::list<Key>::iterator place;
  };
  /// Memory of blocks that nobody holds any more, few: taking fresh memory costs more than filling it.
  /// Thread-safe.
  class Spare {
   public:
    std::unique_ptr<Block> take();
    void give(std::unique_ptr<Block> block);

   private:
    std::mutex mutex_;  // guards blocks_
    std::vector<std::unique_ptr<Block>> blocks_;
  };
  void keep(const Key& key, const BlockPtr& block);

  const std::uint64_t limit_bytes_;
  const std::shared_ptr<Spare> spare_ = std::make_shared<Spare>();  // blocks may outlive the cache
  std::mutex mutex_;                                                // guards what follows; not held while decoding
  std::unordered_map<Key, Slot, Hash> slots_;
  std::list<Key> used_;  // decoded ones, last used first
  std::uint64_t held_bytes_ = 0;
  std::uint32_t rasters_ = 0;
};

}  // namespace nadir::mosaic

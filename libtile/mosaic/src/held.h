#pragma once

#include <vector>

#include "nadir/mosaic/block.h"

namespace nadir::mosaic {

/// How much of a texel holds data.
enum class Holds : std::uint8_t {
  Nothing = 0,  // masked, transparent, or no data band does
  Some = 1,     // one band and not another, or under partial opacity
  All = 255,
};

/// What each texel of a block holds.
class Held {
 public:
  /// `block` may be without a mask where `type` has one: that says nothing against its texels.
  void read(const TexelType& type, const Block& block);

  /// Whether every texel holds all: there is nothing to look up.
  bool all() const { return all_; }
  /// From the first texel of the block's window on.
  const Holds* texels() const { return texels_.data(); }

 private:
  bool all_ = true;
  std::vector<Holds> texels_;
};

}  // namespace nadir::mosaic

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels.h"
#include "nadir/render/sample_block.h"

namespace nadir::render {

/// How bands lie in a patch: alone where there is one, else in groups of four channels. Validity takes a channel that
/// is left over, or a group of its own.
struct ChannelLayout {
  explicit ChannelLayout(int all_bands)
      : bands(all_bands),
        channels(bands == 1 ? 1 : 4),
        groups((bands + channels - 1) / channels),
        validity_apart(bands % channels == 0),
        validity_channel(validity_apart ? 0 : bands % channels) {}
  int bands, channels;
  int groups;           // of bands
  bool validity_apart;  // in a group of one channel, after all others; else in the last one's `validity_channel`
  int validity_channel;
  int channels_of(int group) const { return group < groups ? channels : 1; }
  int validity_group() const { return validity_apart ? groups : groups - 1; }
  std::size_t texel_samples() const { return static_cast<std::size_t>(groups * channels + (validity_apart ? 1 : 0)); }
};

/// A rectangle of a level's texels, as its window counts them.
struct TexelRect {
  std::int64_t col = 0, row = 0;
  int cols = 0, rows = 0;
};

/// Texels of a level, copied together out of its cells: what lies beyond an edge or in another cell is a neighbour like
/// any other here. Invalid texels are 0. Validity is `full` or 0.
template <class T>
class TexelPatch {
 public:
  static constexpr T full = std::is_same_v<T, std::uint8_t> ? 255 : 1;

  void fill(const Kernels& kernels, const LevelWindow& window, const ChannelLayout& layout, const TexelRect& rect);

  const TexelRect& rect() const { return rect_; }
  /// Whether some texel is invalid. Where validity has a group of its own, it is there only then.
  bool masked() const { return masked_; }
  const T* group(int i) const { return groups_[static_cast<std::size_t>(i)].data(); }

 private:
  void copy_run(const Kernels& kernels, const ChannelLayout& layout, const tile::Cell& cell, std::size_t from,
                int count, std::size_t to);
  void copy_validity(const ChannelLayout& layout, const std::uint8_t* valid, int count, std::size_t to);

  TexelRect rect_;
  bool masked_ = false;
  std::vector<std::vector<T>> groups_;
};

extern template class TexelPatch<std::uint8_t>;
extern template class TexelPatch<std::int16_t>;
extern template class TexelPatch<std::uint16_t>;
extern template class TexelPatch<float>;

}  // namespace nadir::render

#pragma once

#include <type_traits>
#include <vector>

#include "block_geometry.h"
#include "texel_patch.h"

namespace nadir::render {

/// Pixels that arrays of a row have room for: kernels write whole vectors, from any pixel on.
inline constexpr std::size_t row_room_px = row_px + 32;

/// Pixels of one row of a block, at most row_px.
struct PixelRow {
  int x, y, count;
};

/// Pixels of a row that share their levels, as the block's windows count them.
struct LevelSegment {
  int first = 0, end = 0, level = 0;
  bool blended = false;  // some with the next level
};

/// Levels of a row's pixels.
template <class Value>
struct RowLevels {
  std::vector<LevelSegment> segments;
  // Of the coarser level, for each pixel: once, and as often as it has channels in a group of four
  Value shares[row_room_px] = {}, shares4[4 * row_room_px] = {};
};

/// Where a segment's samples lie.
struct SegmentPlaces {
  Places fine, coarse;
};

/// What a thread keeps of a picture from block to block, so that it need not ask for memory.
template <class T>
struct PictureScratch {
  std::vector<TexelPatch<T>> patches;  // of the block's levels
  std::vector<std::int16_t> fixed_values, fixed_coarse;
  std::vector<std::int32_t> fixed_sums;
  std::vector<float> values, coarse, sums;
  std::vector<T> texels;
};

/// A block's pixels of one source, made row by row from samples whose places are given. `Value`: what one sample is
/// while it is worked on.
/// One thread at a time.
template <class T, class Value>
class BlockPicture {
 public:
  BlockPicture(const Kernels& kernels, const BlockSampling& block, const ChannelLayout& layout, bool decibel,
               const BlockTarget& target, std::size_t stride_px, PictureScratch<T>& scratch);

  void clear(const Part& part);

  // Texels of a part: of each level of some, in any order
  void begin_part() { masked_ = false; }
  void fill_patch(int level, const TexelRect& rect);
  /// Texels that are not filled in yet may be invalid.
  void expect_invalid() { masked_ = true; }

  // A row: its samples, then what they make. `on_map`: of its pixels' centres.
  void begin_row() { first_sample_ = true; }
  void take(const LevelSegment& segment, const SegmentPlaces& places, const RowLevels<Value>& levels);
  void add_sample(const PixelRow& row);
  void finish(const PixelRow& row, const std::uint8_t* on_map);

  // A row of nearest samples instead
  void begin_nearest(const PixelRow& row, const std::uint8_t* on_map);
  void take_nearest(const PixelRow& row, const LevelSegment& segment, const Places& places);
  void finish_nearest(const PixelRow& row);

 private:
  using Sum = std::conditional_t<std::is_same_v<Value, std::int16_t>, std::int32_t, float>;
  static constexpr bool fixed = std::is_same_v<Value, std::int16_t>;

  void take_group(const Places& places, int level, int group, int count, Value* out) const;
  void take_values(const LevelSegment& segment, const SegmentPlaces& places, const RowLevels<Value>& levels, int group);
  void normalise(const PixelRow& row);
  void write(const PixelRow& row);
  void write_decibel(const PixelRow& row);
  void write_validity(const PixelRow& row);

  T* pixel(const PixelRow& row) const;
  std::vector<Value>& all_values() const;
  std::vector<Value>& coarse_values() const;
  std::vector<Sum>& all_sums() const;
  Value* values(int group) const { return all_values().data() + static_cast<std::size_t>(group) * row_room_px * 4; }
  Sum* sums(int group) const { return all_sums().data() + static_cast<std::size_t>(group) * row_room_px * 4; }
  int groups_taken() const { return layout_.groups + (layout_.validity_apart && masked_ ? 1 : 0); }

  const Kernels& kernels_;
  const BlockSampling& block_;
  const ChannelLayout& layout_;
  const bool decibel_;
  const std::span<const LevelWindow> levels_;
  T* const out_;
  std::uint8_t* const validity_;
  const std::size_t stride_px_;
  const bool one_sample_;
  PictureScratch<T>& scratch_;

  bool masked_ = false;  // some texel of the part is
  bool first_sample_ = true;
  std::uint8_t valid_[row_px] = {};
  bool all_valid_ = false;  // is written there
};

extern template class BlockPicture<std::uint8_t, std::int16_t>;
extern template class BlockPicture<std::uint8_t, float>;
extern template class BlockPicture<std::int16_t, float>;
extern template class BlockPicture<std::uint16_t, float>;
extern template class BlockPicture<float, float>;

}  // namespace nadir::render

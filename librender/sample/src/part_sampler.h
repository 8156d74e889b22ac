#pragma once

#include <span>
#include <type_traits>
#include <vector>

#include "block_picture.h"

namespace nadir::render {

/// Texels of one level that a patch holds at most, of all its bands, in bytes: with what else a thread needs, they stay
/// in a second-level cache.
inline constexpr double most_patch_bytes = 256 << 10;
/// Coordinates of 15 bits of fraction fit 32 bits.
inline constexpr double most_patch_side = 1 << 15;

/// What a thread keeps from block to block, so that it need not ask for memory.
template <class T>
struct SamplerScratch {
  std::vector<PatchFrame> frames;  // of the block's levels
  SegmentPlaces places;
  alignas(64) double u[row_room_px] = {}, v[row_room_px] = {};
  std::vector<PictureScratch<T>> pictures;
};

/// Samples parts of a block whose texels fit patches, in pictures of sources on one grid: where their samples lie is
/// found once. `Value`: what one sample is while it is worked on.
/// One thread at a time.
template <class T, class Value>
class PartSampler {
 public:
  PartSampler(const Kernels& kernels, const BlockSampling& block, int bands, bool decibel,
              std::span<const BlockTarget> targets, std::size_t stride_px, SamplerScratch<T>& scratch);

  /// Any part, cut as often as it takes.
  void sample(const Part& part);

 private:
  static constexpr bool fixed = std::is_same_v<Value, std::int16_t>;

  /// Levels of the block's windows, from `first` to `last`.
  struct LevelRange {
    int first, last;
  };
  double level_at(double x, double y) const;
  LevelBlend::Choice choose(double coordinate) const;
  LevelRange levels_of(const Part& part) const;
  SampleSpan span_of(int i, int j) const;

  /// False where the texels of `bounds` are too many for this many samples.
  bool make_patches(const Eigen::AlignedBox2d& bounds, const LevelRange& levels, std::size_t samples);
  void sample_halves(const Part& part);
  void clear(const Part& part);
  void sample_rows(const Part& part);
  void sample_by_samples(const Part& pixel, const LevelRange& levels);

  void start(const PixelRow& row);
  /// Samples so far from their pixels' corners are in hand.
  void take_up(const PixelRow& row, double offset_x, double offset_y);
  void add_sample(const PixelRow& row, int i, int j);
  void place(const PixelRow& row, const LevelSegment& segment, int level, Places& places);
  /// Texels of the row's samples, unless they are there.
  void project(const PixelRow& row);
  void note_on_map(const PixelRow& row);
  void finish(const PixelRow& row);
  void take_nearest(const PixelRow& row);

  const Kernels& kernels_;
  const BlockSampling& block_;
  const BlockGeometry geometry_;
  const ChannelLayout layout_;
  const bool one_sample_;
  LevelBlend blend_;
  std::vector<BlockPicture<T, Value>> pictures_;

  LevelRange levels_{0, 0};  // whose patches are made
  SamplerScratch<T>& scratch_;

  // Of the row in hand
  RowLevels<Value> row_levels_;
  double offset_x_ = 0, offset_y_ = 0;  // of the samples in hand, from their pixels' corners
  double path_y_ = 0;                   // of the path in hand; NaN without one
  TexelPath path_;                      // of them, where the block has paths
  RowMiddle middle_;                    // likewise
  bool projected_ = false;              // to scratch_.u and v
  std::uint8_t on_map_[row_px] = {};    // whether pixels' centres are
};

}  // namespace nadir::render

#pragma once

#include <type_traits>
#include <vector>

#include "block_geometry.h"
#include "texel_patch.h"

namespace nadir::render {

/// Texels of one level that a patch holds at most, of all its bands, in bytes: with what else a thread needs, they stay
/// in a second-level cache.
inline constexpr double most_patch_bytes = 256 << 10;
/// Coordinates of 15 bits of fraction fit 32 bits.
inline constexpr double most_patch_side = 1 << 15;

/// Pixels that arrays of a row have room for: kernels write whole vectors, from any pixel on.
inline constexpr std::size_t row_room_px = row_px + 32;

/// What a thread keeps from block to block, so that it need not ask for memory.
template <class T>
struct Scratch {
  std::vector<TexelPatch<T>> patches;  // of the block's levels
  std::vector<PatchFrame> frames;
  Places fine_places, coarse_places;
  alignas(64) double u[row_room_px] = {}, v[row_room_px] = {};
  std::vector<std::int16_t> fixed_values, fixed_coarse;
  std::vector<std::int32_t> fixed_sums;
  std::vector<float> values, coarse, sums;
  std::vector<T> texels;
};

/// Samples parts of a block whose texels fit patches. `Value`: what one sample is while it is worked on.
/// One thread at a time.
template <class T, class Value>
class PartSampler {
 public:
  PartSampler(const Kernels& kernels, const BlockSampling& block, int bands, bool decibel, T* out,
              std::uint8_t* validity, std::size_t stride_px, Scratch<T>& scratch);

  /// Any part, cut as often as it takes.
  void sample(const Part& part);

 private:
  using Sum = std::conditional_t<std::is_same_v<Value, std::int16_t>, std::int32_t, float>;
  static constexpr bool fixed = std::is_same_v<Value, std::int16_t>;

  /// Levels of the block's windows, from `first` to `last`.
  struct LevelRange {
    int first, last;
  };
  /// Pixels of a row that share their levels.
  struct Segment {
    int first = 0, end = 0, level = 0;
    bool blended = false;
  };
  /// Pixels of one row, at most row_px.
  struct Row {
    int x, y, count;
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

  void start(const Row& row);
  /// Samples so far from their pixels' corners are in hand.
  void take_up(const Row& row, const Eigen::Vector2d& offset);
  void add_sample(const Row& row, int i, int j);
  void take_values(const Segment& segment, int group);
  void place(const Row& row, const Segment& segment, int level, Places& places);
  /// Texels of the row's samples, unless they are there.
  void project(const Row& row);
  void take_group(const Places& places, int level, int group, int count, Value* out) const;
  void note_on_map(const Row& row);
  void finish(const Row& row);
  void normalise(const Row& row);
  void write(const Row& row);
  void write_decibel(const Row& row);
  void take_nearest(const Row& row);

  T* pixel(const Row& row) const;
  std::vector<Value>& all_values() const;
  std::vector<Value>& coarse_values() const;
  std::vector<Sum>& all_sums() const;
  Value* values(int group) const { return all_values().data() + static_cast<std::size_t>(group) * row_room_px * 4; }
  Sum* sums(int group) const { return all_sums().data() + static_cast<std::size_t>(group) * row_room_px * 4; }
  int groups_taken() const { return layout_.groups + (layout_.validity_apart && masked_ ? 1 : 0); }

  const Kernels& kernels_;
  const BlockSampling& block_;
  const BlockGeometry geometry_;
  const ChannelLayout layout_;
  const bool decibel_;
  T* const out_;
  std::uint8_t* const validity_;
  const std::size_t stride_px_;
  const bool one_sample_;
  LevelBlend blend_;

  LevelRange levels_{0, 0};  // whose patches are made
  Scratch<T>& scratch_;
  bool masked_ = false;

  // Of the row in hand
  std::vector<Segment> segments_;
  // Of the coarser level, for each pixel: once, and as often as it has channels in a group of four
  Value shares_[row_room_px] = {}, shares4_[4 * row_room_px] = {};
  bool first_sample_ = true;
  Eigen::Vector2d offset_ = Eigen::Vector2d::Zero();  // of the samples in hand, from their pixels' corners
  double path_y_ = 0;                                 // of the path in hand; NaN without one
  RowPath path_;                                      // of them, where the block has paths
  RowMiddle middle_;                                  // likewise
  bool projected_ = false;                            // to scratch_.u and v
  std::uint8_t valid_[row_px] = {};
};

}  // namespace nadir::render

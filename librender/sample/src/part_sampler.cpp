#include "part_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "row_math.h"

namespace nadir::render {

template <class T, class Value>
PartSampler<T, Value>::PartSampler(const Kernels& kernels, const BlockSampling& block, int bands, bool decibel,
                                   std::span<const BlockTarget> targets, std::size_t stride_px,
                                   SamplerScratch<T>& scratch)
    : kernels_(kernels),
      block_(block),
      geometry_(block),
      layout_(bands),
      one_sample_(block.samples_x * block.samples_y == 1),
      blend_(block.interpolation == Interpolation::Nearest ? LevelBlend{0} : block.level_blend),
      scratch_(scratch) {
  if (scratch.frames.size() < block.levels.size()) scratch.frames.resize(block.levels.size());
  if (scratch.pictures.size() < targets.size()) scratch.pictures.resize(targets.size());
  for (std::size_t i = 0; i < targets.size(); ++i)
    pictures_.emplace_back(kernels, block, layout_, decibel, targets[i], stride_px, scratch.pictures[i]);
  std::fill_n(on_map_, row_px, std::uint8_t{1});
}

// ---- parts and their texels

template <class T, class Value>
void PartSampler<T, Value>::sample(const Part& part) {
  const Eigen::AlignedBox2d bounds =
      geometry_.bounds(part, {span_of(0, 0).first, span_of(block_.samples_x - 1, block_.samples_y - 1).first});
  const bool pixel = part.width == 1 && part.height == 1;
  if (bounds.isEmpty()) return clear(part);
  if (!bounds.min().allFinite() || !bounds.max().allFinite()) return pixel ? clear(part) : sample_halves(part);
  const Eigen::Vector2d at = geometry_.origin();
  if (!Eigen::AlignedBox2d(Eigen::Vector2d(0, 0), Eigen::Vector2d(block_.map_width, block_.map_height))
           .intersects(Eigen::AlignedBox2d(at + bounds.min(), at + bounds.max())))
    return clear(part);

  const LevelRange levels = levels_of(part);
  const auto samples = static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height) *
                       static_cast<std::size_t>(block_.samples_x) * static_cast<std::size_t>(block_.samples_y);
  if (make_patches(bounds, levels, samples)) return sample_rows(part);
  pixel ? sample_by_samples(part, levels) : sample_halves(part);
}

template <class T, class Value>
void PartSampler<T, Value>::clear(const Part& part) {
  for (auto& picture : pictures_) picture.clear(part);
}

template <class T, class Value>
void PartSampler<T, Value>::sample_halves(const Part& part) {
  for (const Part& half : part.halves()) sample(half);
}

/// Of the sample in column i and row j of a pixel's grid.
template <class T, class Value>
SampleSpan PartSampler<T, Value>::span_of(int i, int j) const {
  const Eigen::Vector2d at((i + 0.5) / block_.samples_x, (j + 0.5) / block_.samples_y);
  return {at, at};
}

template <class T, class Value>
double PartSampler<T, Value>::level_at(double x, double y) const {
  const auto& corner = block_.level_at_corner;
  const double right = x / block_.width, down = y / block_.height;
  const double at_left = corner[0] + down * (corner[3] - corner[0]),
               at_right = corner[1] + down * (corner[2] - corner[1]);
  return at_left + right * (at_right - at_left);
}

/// Levels as the block's windows count them.
template <class T, class Value>
LevelBlend::Choice PartSampler<T, Value>::choose(double coordinate) const {
  const int last = static_cast<int>(block_.levels.size()) - 1;
  const auto [finer, coarser] = blend_(std::max(coordinate - block_.levels[0].level, 0.0));
  return finer < last ? LevelBlend::Choice{finer, coarser} : LevelBlend::Choice{last, 0};
}

template <class T, class Value>
auto PartSampler<T, Value>::levels_of(const Part& part) const -> LevelRange {
  if (block_.levels.size() == 1) return {0, 0};
  double low = level_at(part.x, part.y), high = low;
  for (const int x : {part.x, part.x + part.width})
    for (const int y : {part.y, part.y + part.height}) {
      low = std::min(low, level_at(x, y));
      high = std::max(high, level_at(x, y));
    }
  const LevelBlend::Choice last = choose(high);
  return {choose(low).finer, last.finer + (last.coarser > 0)};
}

template <class T, class Value>
bool PartSampler<T, Value>::make_patches(const Eigen::AlignedBox2d& bounds, const LevelRange& levels,
                                         std::size_t samples) {
  const int reach = block_.interpolation == Interpolation::Cubic ? 1 : 0;
  const double half = block_.interpolation == Interpolation::Nearest ? 0 : 0.5;
  const Eigen::Vector2d map(block_.map_width, block_.map_height), at = geometry_.origin();
  const Eigen::Vector2d low = (at + bounds.min()).cwiseMax(0).cwiseMin(map),
                        high = (at + bounds.max()).cwiseMax(0).cwiseMin(map);
  levels_ = levels;
  for (auto& picture : pictures_) picture.begin_part();
  for (int k = levels.first; k <= levels.last; ++k) {
    const LevelWindow& window = block_.levels[static_cast<std::size_t>(k)];
    const auto first = [&](double texel, double size) { return std::floor(texel / size - half) - reach; };
    // To the texel after the last one's, and one more, so that the last fraction is held too
    const auto count = [&](double from, double to, double size) {
      return std::floor(to / size - half) + 3 + reach - first(from, size);
    };
    const double cols = count(low.x(), high.x(), window.texels_x), rows = count(low.y(), high.y(), window.texels_y);
    // A patch costs as much as its texels: many more of them than samples are better read in parts
    constexpr double always = 64;
    const double texel_bytes = static_cast<double>(layout_.texel_samples() * sizeof(T));
    const double most = std::max(std::min(most_patch_bytes / texel_bytes, 8.0 * static_cast<double>(samples)), always);
    if (cols * rows > most || std::max(cols, rows) > most_patch_side) return false;
    const TexelRect rect{static_cast<std::int64_t>(first(low.x(), window.texels_x)),
                         static_cast<std::int64_t>(first(low.y(), window.texels_y)), static_cast<int>(cols),
                         static_cast<int>(rows)};
    for (auto& picture : pictures_) picture.fill_patch(k, rect);

    PatchFrame& frame = scratch_.frames[static_cast<std::size_t>(k)];
    frame.scale_x = 1 / window.texels_x;
    frame.scale_y = 1 / window.texels_y;
    frame.offset_x = at.x() * frame.scale_x - static_cast<double>(rect.col) - half;
    frame.offset_y = at.y() * frame.scale_y - static_cast<double>(rect.row) - half;
    frame.low = reach;
    frame.high_x = rect.cols - 2 - reach;
    frame.high_y = rect.rows - 2 - reach;
    frame.pitch = rect.cols;
  }
  return true;
}

template <class T, class Value>
void PartSampler<T, Value>::sample_rows(const Part& part) {
  for (int y = part.y; y < part.y + part.height; ++y)
    for (int x = part.x; x < part.x + part.width; x += row_px) {
      const PixelRow row{x, y, std::min(row_px, part.x + part.width - x)};
      start(row);
      if (block_.interpolation == Interpolation::Nearest) {
        take_nearest(row);
        continue;
      }
      for (int j = 0; j < block_.samples_y; ++j)
        for (int i = 0; i < block_.samples_x; ++i) add_sample(row, i, j);
      finish(row);
    }
}

/// One pixel that spans more texels than a patch holds: each sample has its own.
template <class T, class Value>
void PartSampler<T, Value>::sample_by_samples(const Part& part, const LevelRange& levels) {
  const PixelRow row{part.x, part.y, 1};
  start(row);
  for (int j = 0; j < block_.samples_y; ++j)
    for (int i = 0; i < block_.samples_x; ++i) {
      if (!make_patches(geometry_.bounds(part, span_of(i, j)), levels, 1)) continue;
      for (auto& picture : pictures_) picture.expect_invalid();
      add_sample(row, i, j);
    }
  finish(row);
}

// ---- rows

template <class T, class Value>
void PartSampler<T, Value>::start(const PixelRow& row) {
  for (auto& picture : pictures_) picture.begin_row();
  path_y_ = std::numeric_limits<double>::quiet_NaN();
  auto& [segments, shares, shares4] = row_levels_;
  segments.clear();
  if (levels_.first == levels_.last) {
    segments.push_back({0, row.count, levels_.first, false});
    return;
  }
  const double left = level_at(0, row.y + 0.5), step = (level_at(block_.width, row.y + 0.5) - left) / block_.width;
  int levels[row_px];
  for (int i = 0; i < row.count; ++i) {
    const auto [finer, coarser] = choose(left + step * (row.x + i + 0.5));
    levels[i] = std::clamp(finer, levels_.first, levels_.last);
    const double share = levels[i] == finer && finer < levels_.last ? coarser : 0;
    if constexpr (fixed)
      shares[i] =
          static_cast<Value>(std::min(static_cast<int>(share * (1 << fraction_bits) + 0.5), (1 << fraction_bits) - 1));
    else
      shares[i] = static_cast<Value>(share);
  }
  for (int i = 0; i < row.count; ++i) {
    for (int c = 0; c < 4; ++c) shares4[4 * i + c] = shares[i];
    if (segments.empty() || segments.back().level != levels[i]) segments.push_back({i, i, levels[i], false});
    segments.back().end = i + 1;
    segments.back().blended = segments.back().blended || shares[i] != 0;
  }
}

template <class T, class Value>
void PartSampler<T, Value>::take_up(const PixelRow& row, double offset_x, double offset_y) {
  offset_x_ = offset_x;
  offset_y_ = offset_y;
  projected_ = false;
  const double y = row.y + offset_y;
  if (!geometry_.has_paths() || y == path_y_) return;
  path_y_ = y;
  path_ = geometry_.path(y);
  middle_ = middle_of(path_, row.x + 0.5, row.count);
}

template <class T, class Value>
void PartSampler<T, Value>::project(const PixelRow& row) {
  if (projected_) return;
  if (geometry_.has_paths())
    kernels_.project(path_.numbers(), row.x + offset_x_, row.count, scratch_.u, scratch_.v);
  else
    geometry_.given_row(row.x, row.y, row.count, {offset_x_, offset_y_}, scratch_.u, scratch_.v);
  projected_ = true;
}

template <class T, class Value>
void PartSampler<T, Value>::place(const PixelRow& row, const LevelSegment& segment, int level, Places& places) {
  const bool nearest = block_.interpolation == Interpolation::Nearest;
  const int count = segment.end - segment.first;
  const PatchFrame& frame = scratch_.frames[static_cast<std::size_t>(level)];
  if (geometry_.has_paths() && !nearest)
    if (const auto in_patch = patch_row(middle_, segment.first + offset_x_ - 0.5, frame))
      return (fixed ? kernels_.place_row_fixed : kernels_.place_row)(*in_patch, frame, count, places);
  project(row);
  (fixed && !nearest ? kernels_.place_fixed : kernels_.place)(scratch_.u + segment.first, scratch_.v + segment.first,
                                                              frame, count, places);
}

template <class T, class Value>
void PartSampler<T, Value>::add_sample(const PixelRow& row, int i, int j) {
  take_up(row, (i + 0.5) / block_.samples_x, (j + 0.5) / block_.samples_y);
  if (one_sample_) note_on_map(row);  // the sample is the centre
  for (const LevelSegment& segment : row_levels_.segments) {
    place(row, segment, segment.level, scratch_.places.fine);
    if (segment.blended) place(row, segment, segment.level + 1, scratch_.places.coarse);
    for (auto& picture : pictures_) picture.take(segment, scratch_.places, row_levels_);
  }
  for (auto& picture : pictures_) picture.add_sample(row);
}

template <class T, class Value>
void PartSampler<T, Value>::note_on_map(const PixelRow& row) {
  if (block_.inside) return;
  project(row);
  const Eigen::Vector2d at = geometry_.origin();
  for (int i = 0; i < row.count; ++i) {
    const double u = at.x() + scratch_.u[i], v = at.y() + scratch_.v[i];
    on_map_[i] = u >= 0 && v >= 0 && u <= block_.map_width && v <= block_.map_height;
  }
}

template <class T, class Value>
void PartSampler<T, Value>::finish(const PixelRow& row) {
  if (!one_sample_) {
    take_up(row, 0.5, 0.5);
    note_on_map(row);
  }
  for (auto& picture : pictures_) picture.finish(row, on_map_);
}

template <class T, class Value>
void PartSampler<T, Value>::take_nearest(const PixelRow& row) {
  take_up(row, 0.5, 0.5);
  note_on_map(row);
  for (auto& picture : pictures_) picture.begin_nearest(row, on_map_);
  for (const LevelSegment& segment : row_levels_.segments) {
    place(row, segment, segment.level, scratch_.places.fine);
    for (auto& picture : pictures_) picture.take_nearest(row, segment, scratch_.places.fine);
  }
  for (auto& picture : pictures_) picture.finish_nearest(row);
}

template class PartSampler<std::uint8_t, std::int16_t>;
template class PartSampler<std::uint8_t, float>;
template class PartSampler<std::int16_t, float>;
template class PartSampler<std::uint16_t, float>;
template class PartSampler<float, float>;

}  // namespace nadir::render

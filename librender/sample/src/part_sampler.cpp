#include "part_sampler.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "row_math.h"

namespace nadir::render {

template <class T, class Value>
PartSampler<T, Value>::PartSampler(const Kernels& kernels, const BlockSampling& block, int bands, bool decibel, T* out,
                                   std::uint8_t* validity, std::size_t stride_px, Scratch<T>& scratch)
    : kernels_(kernels),
      block_(block),
      geometry_(block),
      layout_(bands),
      decibel_(decibel),
      out_(out),
      validity_(validity),
      stride_px_(stride_px),
      one_sample_(block.samples_x * block.samples_y == 1),
      blend_(block.interpolation == Interpolation::Nearest ? LevelBlend{0} : block.level_blend),
      scratch_(scratch) {
  const std::size_t room = (static_cast<std::size_t>(layout_.groups) + 1) * row_room_px * 4;
  const auto grow = [](auto& values, std::size_t size) {
    if (values.size() < size) values.resize(size);
  };
  grow(scratch.patches, block.levels.size());
  grow(scratch.frames, block.levels.size());
  grow(all_values(), room);
  grow(coarse_values(), row_room_px * 4);
  if (!one_sample_) grow(all_sums(), room);
  grow(scratch.texels, row_room_px * 4);
}

template <class T, class Value>
std::vector<Value>& PartSampler<T, Value>::all_values() const {
  if constexpr (fixed)
    return scratch_.fixed_values;
  else
    return scratch_.values;
}
template <class T, class Value>
std::vector<Value>& PartSampler<T, Value>::coarse_values() const {
  if constexpr (fixed)
    return scratch_.fixed_coarse;
  else
    return scratch_.coarse;
}
template <class T, class Value>
auto PartSampler<T, Value>::all_sums() const -> std::vector<Sum>& {
  if constexpr (fixed)
    return scratch_.fixed_sums;
  else
    return scratch_.sums;
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
void PartSampler<T, Value>::sample_halves(const Part& part) {
  for (const Part& half : part.halves()) sample(half);
}

template <class T, class Value>
void PartSampler<T, Value>::clear(const Part& part) {
  for (int y = part.y; y < part.y + part.height; ++y) {
    const Row row{part.x, y, part.width};
    std::fill_n(pixel(row), static_cast<std::size_t>(part.width) * static_cast<std::size_t>(layout_.bands), T{});
    std::fill_n(validity_ + static_cast<std::size_t>(y) * stride_px_ + part.x, part.width, std::uint8_t{0});
  }
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
  masked_ = false;
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
    TexelPatch<T>& patch = scratch_.patches[static_cast<std::size_t>(k)];
    patch.fill(kernels_, window, layout_, rect);
    masked_ = masked_ || patch.masked();

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
      const Row row{x, y, std::min(row_px, part.x + part.width - x)};
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
  const Row row{part.x, part.y, 1};
  start(row);
  for (int j = 0; j < block_.samples_y; ++j)
    for (int i = 0; i < block_.samples_x; ++i) {
      if (!make_patches(geometry_.bounds(part, span_of(i, j)), levels, 1)) continue;
      masked_ = true;  // others may be
      add_sample(row, i, j);
    }
  finish(row);
}

// ---- rows

template <class T, class Value>
void PartSampler<T, Value>::start(const Row& row) {
  first_sample_ = true;
  path_y_ = std::numeric_limits<double>::quiet_NaN();
  segments_.clear();
  if (levels_.first == levels_.last) {
    segments_.push_back({0, row.count, levels_.first, false});
    return;
  }
  const double left = level_at(0, row.y + 0.5), step = (level_at(block_.width, row.y + 0.5) - left) / block_.width;
  int levels[row_px];
  for (int i = 0; i < row.count; ++i) {
    const auto [finer, coarser] = choose(left + step * (row.x + i + 0.5));
    levels[i] = std::clamp(finer, levels_.first, levels_.last);
    const double share = levels[i] == finer && finer < levels_.last ? coarser : 0;
    if constexpr (fixed)
      shares_[i] =
          static_cast<Value>(std::min(static_cast<int>(share * (1 << fraction_bits) + 0.5), (1 << fraction_bits) - 1));
    else
      shares_[i] = static_cast<Value>(share);
  }
  for (int i = 0; i < row.count; ++i) {
    for (int c = 0; c < 4; ++c) shares4_[4 * i + c] = shares_[i];
    if (segments_.empty() || segments_.back().level != levels[i]) segments_.push_back({i, i, levels[i], false});
    segments_.back().end = i + 1;
    segments_.back().blended = segments_.back().blended || shares_[i] != 0;
  }
}

template <class T, class Value>
void PartSampler<T, Value>::take_up(const Row& row, const Eigen::Vector2d& offset) {
  offset_ = offset;
  projected_ = false;
  const double y = row.y + offset.y();
  if (!geometry_.has_paths() || y == path_y_) return;
  path_y_ = y;
  geometry_.set_path(y, path_);
  set_middle(path_, row.x + 0.5, row.count, middle_);
}

template <class T, class Value>
void PartSampler<T, Value>::project(const Row& row) {
  if (projected_) return;
  if (geometry_.has_paths())
    kernels_.project(path_, row.x + offset_.x(), row.count, scratch_.u, scratch_.v);
  else
    geometry_.given_row(row.x, row.y, row.count, offset_, scratch_.u, scratch_.v);
  projected_ = true;
}

template <class T, class Value>
void PartSampler<T, Value>::place(const Row& row, const Segment& segment, int level, Places& places) {
  const bool nearest = block_.interpolation == Interpolation::Nearest;
  const int count = segment.end - segment.first;
  const PatchFrame& frame = scratch_.frames[static_cast<std::size_t>(level)];
  if (geometry_.has_paths() && !nearest)
    if (const auto in_patch = patch_row(middle_, segment.first + offset_.x() - 0.5, frame))
      return (fixed ? kernels_.place_row_fixed : kernels_.place_row)(*in_patch, frame, count, places);
  project(row);
  (fixed && !nearest ? kernels_.place_fixed : kernels_.place)(scratch_.u + segment.first, scratch_.v + segment.first,
                                                              frame, count, places);
}

template <class T, class Value>
void PartSampler<T, Value>::take_group(const Places& places, int level, int group, int count, Value* out) const {
  const TexelPatch<T>& patch = scratch_.patches[static_cast<std::size_t>(level)];
  const int channels = layout_.channels_of(group);
  if (group == layout_.groups && !patch.masked()) {
    std::fill_n(out, count, static_cast<Value>(TexelPatch<T>::full * (fixed ? fixed_one : 1)));
    return;
  }
  const T* texels = patch.group(group);
  const TypeKernels<T>& of_type = kernels_.of<T>();
  const std::int32_t pitch = patch.rect().cols;
  if constexpr (std::is_same_v<Value, Bilinear<T>>) {
    if (block_.interpolation == Interpolation::Bilinear)
      return (channels == 4 ? of_type.bilinear4 : of_type.bilinear1)(texels, pitch, places, count, out);
  }
  if constexpr (!fixed) (channels == 4 ? of_type.cubic4 : of_type.cubic1)(texels, pitch, places, count, out);
}

template <class T, class Value>
void PartSampler<T, Value>::take_values(const Segment& segment, int group) {
  const int count = segment.end - segment.first, channels = layout_.channels_of(group);
  Value* out = values(group) + channels * segment.first;
  take_group(scratch_.fine_places, segment.level, group, count, out);
  if (!segment.blended) return;
  Value* coarse = coarse_values().data();
  take_group(scratch_.coarse_places, segment.level + 1, group, count, coarse);
  const Value* shares = channels == 4 ? shares4_ + 4 * segment.first : shares_ + segment.first;
  if constexpr (fixed)
    kernels_.blend_fixed(coarse, shares, channels * count, out);
  else
    kernels_.blend(coarse, shares, channels * count, out);
}

template <class T, class Value>
void PartSampler<T, Value>::add_sample(const Row& row, int i, int j) {
  take_up(row, span_of(i, j).first);
  if (one_sample_) note_on_map(row);  // the sample is the centre
  for (const Segment& segment : segments_) {
    place(row, segment, segment.level, scratch_.fine_places);
    if (segment.blended) place(row, segment, segment.level + 1, scratch_.coarse_places);
    for (int group = 0; group < groups_taken(); ++group) take_values(segment, group);
  }
  if (one_sample_) return;
  for (int group = 0; group < groups_taken(); ++group) {
    const int count = row.count * layout_.channels_of(group);
    const Value* from = values(group);
    Sum* to = sums(group);
    if (first_sample_)
      std::copy_n(from, count, to);
    else if constexpr (fixed)
      kernels_.add_fixed(from, count, to);
    else
      kernels_.add(from, count, to);
  }
  first_sample_ = false;
}

template <class T, class Value>
void PartSampler<T, Value>::note_on_map(const Row& row) {
  if (block_.inside) {
    std::fill_n(valid_, row.count, std::uint8_t{1});
    return;
  }
  project(row);
  const Eigen::Vector2d at = geometry_.origin();
  for (int i = 0; i < row.count; ++i) {
    const double u = at.x() + scratch_.u[i], v = at.y() + scratch_.v[i];
    valid_[i] = u >= 0 && v >= 0 && u <= block_.map_width && v <= block_.map_height;
  }
}

template <class T, class Value>
void PartSampler<T, Value>::finish(const Row& row) {
  if (!one_sample_) {
    if (first_sample_) return clear({row.x, row.y, row.count, 1});  // none could be taken
    take_up(row, {0.5, 0.5});
    note_on_map(row);
  }
  if (masked_ || !block_.inside) normalise(row);
  write(row);
  std::copy_n(valid_, row.count, validity_ + static_cast<std::size_t>(row.y) * stride_px_ + row.x);
}

template <class T, class Value>
void PartSampler<T, Value>::normalise(const Row& row) {
  const int samples = block_.samples_x * block_.samples_y;
  const Sum full = static_cast<Sum>(TexelPatch<T>::full * (fixed ? fixed_one : 1)) * static_cast<Sum>(samples);
  const auto each_group = [&](int i, auto&& visit) {
    for (int group = 0; group < layout_.groups; ++group) {
      const int channels = layout_.channels;
      if (one_sample_)
        for (int c = 0; c < channels; ++c) visit(values(group)[channels * i + c]);
      else
        for (int c = 0; c < channels; ++c) visit(sums(group)[channels * i + c]);
    }
  };
  Sum weights[row_px];  // of the valid texels
  std::fill_n(weights, row.count, full);
  if (masked_) {
    const int group = layout_.validity_group(), channels = layout_.channels_of(group);
    const auto take = [&](const auto* from) {
      for (int i = 0; i < row.count; ++i) weights[i] = static_cast<Sum>(from[channels * i + layout_.validity_channel]);
    };
    one_sample_ ? take(values(group)) : take(sums(group));
  }
  bool whole = true;
  for (int i = 0; i < row.count; ++i) whole = whole & (weights[i] == full) & (valid_[i] != 0);
  if (whole) return;

  for (int i = 0; i < row.count; ++i) {
    const Sum weight = weights[i];
    valid_[i] = valid_[i] && weight >= full - weight;
    if (!valid_[i]) {
      each_group(i, [](auto& value) { value = 0; });
    } else if (weight != full) {
      each_group(i, [&](auto& value) {
        if constexpr (fixed)
          value = static_cast<std::decay_t<decltype(value)>>((static_cast<std::int64_t>(value) * full + weight / 2) /
                                                             weight);
        else
          value *= full / weight;
      });
    }
  }
}

template <class T, class Value>
T* PartSampler<T, Value>::pixel(const Row& row) const {
  return out_ + (static_cast<std::size_t>(row.y) * stride_px_ + static_cast<std::size_t>(row.x)) *
                    static_cast<std::size_t>(layout_.bands);
}

template <class T, class Value>
void PartSampler<T, Value>::write(const Row& row) {
  T* out = pixel(row);
  const float scale = 1.0f / (static_cast<float>(block_.samples_x * block_.samples_y) * (fixed ? fixed_one : 1));
  const auto round = [&](int group, T* to) {
    const int count = row.count * layout_.channels;
    if constexpr (fixed)
      one_sample_ ? kernels_.round_fixed(values(group), count, to) : kernels_.round_sums(sums(group), count, scale, to);
    else
      kernels_.of<T>().round(one_sample_ ? values(group) : sums(group), count, scale, to);
  };
  const int bands = layout_.bands;
  if (bands == layout_.channels) {
    round(0, out);
  } else {
    T* texels = scratch_.texels.data();
    for (int group = 0, band = 0; band < bands; ++group, band += 4) {
      round(group, texels);
      if constexpr (std::is_same_v<T, std::uint8_t>) {
        if (bands == 3) {
          kernels_.narrow3(texels, row.count, out);
          continue;
        }
      }
      const int here = std::min(4, bands - band);
      for (int i = 0; i < row.count; ++i)
        for (int b = 0; b < here; ++b) out[bands * i + band + b] = texels[4 * i + b];
    }
  }
  write_decibel(row);
}

/// From power, where that is what cells hold of decibels.
template <class T, class Value>
void PartSampler<T, Value>::write_decibel(const Row& row) {
  if constexpr (std::is_same_v<T, float>) {
    if (!decibel_) return;
    T* out = pixel(row);
    for (int i = 0; i < row.count; ++i)
      if (valid_[i])
        for (int b = layout_.bands * i; b < layout_.bands * (i + 1); ++b) out[b] = 10.0f * std::log10(out[b]);
  }
}

template <class T, class Value>
void PartSampler<T, Value>::take_nearest(const Row& row) {
  take_up(row, {0.5, 0.5});
  note_on_map(row);
  for (const Segment& segment : segments_) {
    place(row, segment, segment.level, scratch_.fine_places);
    const TexelPatch<T>& patch = scratch_.patches[static_cast<std::size_t>(segment.level)];
    const int* at = scratch_.fine_places.at - segment.first;
    if (patch.masked()) {
      const int channels = layout_.channels_of(layout_.validity_group());
      const T* texels = patch.group(layout_.validity_group()) + layout_.validity_channel;
      for (int i = segment.first; i < segment.end; ++i) valid_[i] = valid_[i] && texels[channels * at[i]] != T{};
    }
    for (int group = 0, band = 0; group < layout_.groups; ++group, band += layout_.channels) {
      const int here = std::min(layout_.channels, layout_.bands - band);
      T* out = pixel(row) + band;
      for (int i = segment.first; i < segment.end; ++i) {
        const T* texel = patch.group(group) + layout_.channels * at[i];
        for (int b = 0; b < here; ++b) out[layout_.bands * i + b] = valid_[i] ? texel[b] : T{};
      }
    }
  }
  write_decibel(row);
  std::copy_n(valid_, row.count, validity_ + static_cast<std::size_t>(row.y) * stride_px_ + row.x);
}

template class PartSampler<std::uint8_t, std::int16_t>;
template class PartSampler<std::uint8_t, float>;
template class PartSampler<std::int16_t, float>;
template class PartSampler<std::uint16_t, float>;
template class PartSampler<float, float>;

}  // namespace nadir::render

#include "block_picture.h"

#include <algorithm>
#include <cmath>

#include "row_math.h"

namespace nadir::render {

template <class T, class Value>
BlockPicture<T, Value>::BlockPicture(const Kernels& kernels, const BlockSampling& block, const ChannelLayout& layout,
                                     bool decibel, const BlockTarget& target, std::size_t stride_px,
                                     PictureScratch<T>& scratch)
    : kernels_(kernels),
      block_(block),
      layout_(layout),
      decibel_(decibel),
      levels_(target.levels),
      out_(static_cast<T*>(target.samples)),
      validity_(target.validity),
      stride_px_(stride_px),
      one_sample_(block.samples_x * block.samples_y == 1),
      scratch_(scratch) {
  const std::size_t room = (static_cast<std::size_t>(layout_.groups) + 1) * row_room_px * 4;
  const auto grow = [](auto& values, std::size_t size) {
    if (values.size() < size) values.resize(size);
  };
  grow(scratch.patches, levels_.size());
  grow(all_values(), room);
  grow(coarse_values(), row_room_px * 4);
  if (!one_sample_) grow(all_sums(), room);
  grow(scratch.texels, row_room_px * 4);
}

template <class T, class Value>
std::vector<Value>& BlockPicture<T, Value>::all_values() const {
  if constexpr (fixed)
    return scratch_.fixed_values;
  else
    return scratch_.values;
}
template <class T, class Value>
std::vector<Value>& BlockPicture<T, Value>::coarse_values() const {
  if constexpr (fixed)
    return scratch_.fixed_coarse;
  else
    return scratch_.coarse;
}
template <class T, class Value>
auto BlockPicture<T, Value>::all_sums() const -> std::vector<Sum>& {
  if constexpr (fixed)
    return scratch_.fixed_sums;
  else
    return scratch_.sums;
}

template <class T, class Value>
void BlockPicture<T, Value>::clear(const Part& part) {
  for (int y = part.y; y < part.y + part.height; ++y) {
    const PixelRow row{part.x, y, part.width};
    std::fill_n(pixel(row), static_cast<std::size_t>(part.width) * static_cast<std::size_t>(layout_.bands), T{});
    std::fill_n(validity_ + static_cast<std::size_t>(y) * stride_px_ + part.x, part.width, std::uint8_t{0});
  }
}

template <class T, class Value>
void BlockPicture<T, Value>::fill_patch(int level, const TexelRect& rect) {
  TexelPatch<T>& patch = scratch_.patches[static_cast<std::size_t>(level)];
  patch.fill(kernels_, levels_[static_cast<std::size_t>(level)], layout_, rect);
  masked_ = masked_ || patch.masked();
}

template <class T, class Value>
void BlockPicture<T, Value>::take(const LevelSegment& segment, const SegmentPlaces& places,
                                  const RowLevels<Value>& levels) {
  for (int group = 0; group < groups_taken(); ++group) take_values(segment, places, levels, group);
}

template <class T, class Value>
void BlockPicture<T, Value>::take_group(const Places& places, int level, int group, int count, Value* out) const {
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
void BlockPicture<T, Value>::take_values(const LevelSegment& segment, const SegmentPlaces& places,
                                         const RowLevels<Value>& levels, int group) {
  const int count = segment.end - segment.first, channels = layout_.channels_of(group);
  Value* out = values(group) + channels * segment.first;
  take_group(places.fine, segment.level, group, count, out);
  if (!segment.blended) return;
  Value* coarse = coarse_values().data();
  take_group(places.coarse, segment.level + 1, group, count, coarse);
  const Value* shares = channels == 4 ? levels.shares4 + 4 * segment.first : levels.shares + segment.first;
  if constexpr (fixed)
    kernels_.blend_fixed(coarse, shares, channels * count, out);
  else
    kernels_.blend(coarse, shares, channels * count, out);
}

/// What was taken of one sample of each pixel, to the sums.
template <class T, class Value>
void BlockPicture<T, Value>::add_sample(const PixelRow& row) {
  const bool first = first_sample_;
  first_sample_ = false;
  if (one_sample_) return;
  for (int group = 0; group < groups_taken(); ++group) {
    const int count = row.count * layout_.channels_of(group);
    const Value* from = values(group);
    Sum* to = sums(group);
    if (first)
      std::copy_n(from, count, to);
    else if constexpr (fixed)
      kernels_.add_fixed(from, count, to);
    else
      kernels_.add(from, count, to);
  }
}

template <class T, class Value>
void BlockPicture<T, Value>::finish(const PixelRow& row, const std::uint8_t* on_map) {
  if (first_sample_) return clear({row.x, row.y, row.count, 1});  // none could be taken
  const bool all_valid = block_.inside && !masked_;
  if (!all_valid) {
    std::copy_n(on_map, row.count, valid_);
    normalise(row);
  } else if (!all_valid_) {
    std::fill_n(valid_, row_px, std::uint8_t{1});
  }
  all_valid_ = all_valid;
  write(row);
  write_validity(row);
}

template <class T, class Value>
void BlockPicture<T, Value>::normalise(const PixelRow& row) {
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
T* BlockPicture<T, Value>::pixel(const PixelRow& row) const {
  return out_ + (static_cast<std::size_t>(row.y) * stride_px_ + static_cast<std::size_t>(row.x)) *
                    static_cast<std::size_t>(layout_.bands);
}

template <class T, class Value>
void BlockPicture<T, Value>::write(const PixelRow& row) {
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
void BlockPicture<T, Value>::write_decibel(const PixelRow& row) {
  if constexpr (std::is_same_v<T, float>) {
    if (!decibel_) return;
    T* out = pixel(row);
    for (int i = 0; i < row.count; ++i)
      if (valid_[i])
        for (int b = layout_.bands * i; b < layout_.bands * (i + 1); ++b) out[b] = 10.0f * std::log10(out[b]);
  }
}

template <class T, class Value>
void BlockPicture<T, Value>::begin_nearest(const PixelRow& row, const std::uint8_t* on_map) {
  std::copy_n(on_map, row.count, valid_);
  all_valid_ = false;
}

template <class T, class Value>
void BlockPicture<T, Value>::take_nearest(const PixelRow& row, const LevelSegment& segment, const Places& places) {
  const TexelPatch<T>& patch = scratch_.patches[static_cast<std::size_t>(segment.level)];
  const int* at = places.at - segment.first;
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

template <class T, class Value>
void BlockPicture<T, Value>::finish_nearest(const PixelRow& row) {
  write_decibel(row);
  write_validity(row);
}

template <class T, class Value>
void BlockPicture<T, Value>::write_validity(const PixelRow& row) {
  std::copy_n(valid_, row.count, validity_ + static_cast<std::size_t>(row.y) * stride_px_ + row.x);
}

template class BlockPicture<std::uint8_t, std::int16_t>;
template class BlockPicture<std::uint8_t, float>;
template class BlockPicture<std::int16_t, float>;
template class BlockPicture<std::uint16_t, float>;
template class BlockPicture<float, float>;

}  // namespace nadir::render

#include "texel_patch.h"

#include <algorithm>
#include <cstring>

#include "nadir/render/stored_runs.h"

namespace nadir::render {
namespace {

using tile::cell_size;

/// A run of columns, and the cell of the window's first row that holds them. What lies outside of the window is rounded
/// up to, never sampled: any cell will do.
struct CellRun {
  int to, count;
  std::size_t cell, from;  // column in it
};

std::size_t stored_columns(const LevelWindow& window) {
  return window.around ? window.columns.size() : static_cast<std::size_t>(window.cols);
}

std::vector<CellRun> runs_of(const LevelWindow& window, const TexelRect& rect) {
  std::vector<CellRun> runs;
  for_each_stored_run(rect.col, rect.cols, window.width, window.around, [&](const StoredRun& run) {
    const std::int32_t col = run.first / cell_size;
    const std::ptrdiff_t cell =
        window.around ? std::find(window.columns.begin(), window.columns.end(), col) - window.columns.begin()
                      : col - window.first_col;
    const auto last = static_cast<std::ptrdiff_t>(stored_columns(window)) - 1;
    runs.push_back({run.to, run.count, static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(cell, 0, last)),
                    static_cast<std::size_t>(run.first % cell_size)});
  });
  return runs;
}

/// Texels of `Here` bands out of `bands` to groups of four channels, those left over `full`.
template <int Here, class T>
void copy_group(const T* source, std::size_t bands, std::size_t count, T* out) {
  for (std::size_t i = 0; i < count; ++i) {
    T texel[4] = {TexelPatch<T>::full, TexelPatch<T>::full, TexelPatch<T>::full, TexelPatch<T>::full};
    std::memcpy(texel, source + bands * i, Here * sizeof(T));
    std::memcpy(out + 4 * i, texel, sizeof texel);
  }
}

}  // namespace

template <class T>
void TexelPatch<T>::fill(const Kernels& kernels, const LevelWindow& window, const ChannelLayout& layout,
                         const TexelRect& rect) {
  rect_ = rect;
  masked_ = false;
  const std::size_t texels = static_cast<std::size_t>(rect.cols) * static_cast<std::size_t>(rect.rows);
  groups_.resize(static_cast<std::size_t>(layout.groups) + 1);
  for (int i = 0; i < layout.groups; ++i) {
    auto& group = groups_[static_cast<std::size_t>(i)];
    group.resize(std::max(group.size(), texels * static_cast<std::size_t>(layout.channels)));
  }

  const auto runs = runs_of(window, rect);
  const std::size_t stride = stored_columns(window);
  for (int y = 0; y < rect.rows; ++y) {
    const auto row = static_cast<std::int32_t>(std::clamp<std::int64_t>(rect.row + y, 0, window.height - 1));
    const auto cell_row = static_cast<std::size_t>(std::clamp(row / cell_size - window.first_row, 0, window.rows - 1));
    const std::size_t in_cell = static_cast<std::size_t>(row % cell_size) * cell_size;
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(rect.cols);
    for (const CellRun& run : runs)
      copy_run(kernels, layout, *window.cells[cell_row * stride + run.cell], in_cell + run.from, run.count,
               first + static_cast<std::size_t>(run.to));
  }
}

template <class T>
void TexelPatch<T>::copy_run(const Kernels& kernels, const ChannelLayout& layout, const tile::Cell& cell,
                             std::size_t from, int count, std::size_t to) {
  const auto bands = static_cast<std::size_t>(layout.bands), channels = static_cast<std::size_t>(layout.channels);
  const auto texels = static_cast<std::size_t>(count);
  const T* source = cell.data<T>() + from * bands;
  for (std::size_t group = 0, band = 0; band < bands; ++group, band += channels) {
    T* out = groups_[group].data() + to * channels;
    if (bands == channels) {
      std::memcpy(out, source, texels * channels * sizeof(T));
      continue;
    }
    if constexpr (std::is_same_v<T, std::uint8_t>) {
      if (bands == 3) {
        kernels.widen3(source, count, out);
        continue;
      }
    }
    const T* first = source + band;
    switch (std::min(channels, bands - band)) {
      case 1:
        copy_group<1>(first, bands, texels, out);
        break;
      case 2:
        copy_group<2>(first, bands, texels, out);
        break;
      case 3:
        copy_group<3>(first, bands, texels, out);
        break;
      default:
        copy_group<4>(first, bands, texels, out);
    }
  }
  const std::uint8_t* valid = cell.masked() ? cell.validity() + from : nullptr;
  const bool some_invalid = valid && std::memchr(valid, 0, texels);
  if (some_invalid && !masked_) {
    masked_ = true;
    if (layout.validity_apart) {  // all before were valid
      auto& apart = groups_[static_cast<std::size_t>(layout.validity_group())];
      apart.assign(static_cast<std::size_t>(rect_.cols) * static_cast<std::size_t>(rect_.rows), full);
    }
  }
  if (some_invalid) copy_validity(layout, valid, count, to);
}

template <class T>
void TexelPatch<T>::copy_validity(const ChannelLayout& layout, const std::uint8_t* valid, int count, std::size_t to) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    if (valid[i]) continue;
    for (int group = 0; group < static_cast<int>(groups_.size()); ++group) {
      if (group == layout.groups && !layout.validity_apart) break;
      const auto channels = static_cast<std::size_t>(layout.channels_of(group));
      std::fill_n(groups_[static_cast<std::size_t>(group)].begin() + static_cast<std::ptrdiff_t>((to + i) * channels),
                  channels, T{});
    }
  }
}

template class TexelPatch<std::uint8_t>;
template class TexelPatch<std::int16_t>;
template class TexelPatch<std::uint16_t>;
template class TexelPatch<float>;

}  // namespace nadir::render

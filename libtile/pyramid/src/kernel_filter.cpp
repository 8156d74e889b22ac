#include <array>

#include "cover_filter.h"
#include "taps.h"
#include "whole.h"

namespace nadir::pyramid {
namespace {

using mosaic::Mean, mosaic::samples_at, mosaic::to_sample, mosaic::valid_at;

/// Rows by columns of finer rows, each filtered once; texels where something under the kernel does not count in full
/// one by one. Which way a texel goes depends on its own samples alone.
template <class T>
class KernelFilter {
 public:
  KernelFilter(const LevelPair& pair, const Block& fine, Block& coarse)
      : pair_(pair),
        validity_(pair.type),
        fine_(fine),
        coarse_(coarse),
        texel_(pair, fine),
        bands_(static_cast<std::size_t>(pair.type.bands)) {
    const Window& w = coarse.window();
    columns_ = taps(pair.reduction.filter, pair.x.fine, pair.x.coarse, w.x, w.x + w.width);
    rows_ = taps(pair.reduction.filter, pair.y.fine, pair.y.coarse, w.y, w.y + w.height);
  }

  void run() {
    const Window& window = coarse_.window();
    whole_.assign(columns_.size(), 0);
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      const std::int32_t y = window.y + static_cast<std::int32_t>(row);
      T* out = reinterpret_cast<T*>(coarse_.row(y));
      std::uint8_t* valid = coarse_.masked() ? coarse_.valid_row(y) : nullptr;
      if (!pair_.reduction.power) filter_row(rows_[row], out);
      for (std::size_t col = 0; col < columns_.size(); ++col) {
        bool held = true;
        if (!whole_[col])
          held =
              reduce_texel(window.x + static_cast<std::int32_t>(col), y, columns_[col], rows_[row], out + col * bands_);
        if (valid) valid[col] = held ? 255 : 0;
      }
    }
  }

 private:
  struct FilteredRow {
    std::int32_t y = -1;
    std::vector<Mean<T>> means;       // of each coarser column and band
    std::vector<std::uint8_t> whole;  // of each coarser column
  };

  /// A row of the finer level, filtered along its columns; kept as long as the next rows need it.
  const FilteredRow& filtered(std::int32_t y) {
    FilteredRow& row = filtered_[static_cast<std::size_t>(y) % filtered_.size()];
    if (row.y == y) return row;
    row.y = y;
    row.means.resize(columns_.size() * bands_);
    row.whole.assign(columns_.size(), 1);
    const std::int32_t left = fine_.window().x;
    const T* samples = samples_at<T>(fine_, pair_.type, left, y);
    const auto texels = static_cast<std::size_t>(fine_.window().width);
    const std::uint8_t* valid = valid_at(fine_, left, y);
    const bool all = is_whole(pair_.type, validity_, samples, valid, texels) && all_finite(samples, texels * bands_);
    if (!all) {
      texel_whole_.resize(texels);
      for (std::size_t x = 0; x < texels; ++x)
        texel_whole_[x] = validity_.whole(samples + x * bands_, valid ? valid + x : nullptr) ? 1 : 0;
    }
    for (std::size_t col = 0; col < columns_.size(); ++col) {
      const Taps& across = columns_[col];
      const auto first = static_cast<std::size_t>(across.first - left);
      for (std::size_t b = 0; b < bands_; ++b) {
        const T* from = samples + first * bands_ + b;
        Mean<T> mean = 0;
        for (std::size_t k = 0; k < across.weights.size(); ++k, from += bands_)
          mean += static_cast<Mean<T>>(across.weights[k]) * static_cast<Mean<T>>(*from);
        row.means[col * bands_ + b] = mean;
      }
      if (!all)
        for (std::size_t k = 0; k < across.weights.size(); ++k) row.whole[col] &= texel_whole_[first + k];
    }
    return row;
  }

  void filter_row(const Taps& down, T* out) {
    sums_.assign(columns_.size() * bands_, 0);
    std::fill(whole_.begin(), whole_.end(), std::uint8_t{1});
    for (std::size_t k = 0; k < down.weights.size(); ++k) {
      const FilteredRow& from = filtered(down.first + static_cast<std::int32_t>(k));
      const auto weight = static_cast<Mean<T>>(down.weights[k]);
      for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] += weight * from.means[i];
      for (std::size_t col = 0; col < whole_.size(); ++col) whole_[col] &= from.whole[col];
    }
    for (std::size_t col = 0; col < whole_.size(); ++col)
      for (std::size_t i = col * bands_; whole_[col] && i < (col + 1) * bands_; ++i) {
        if (is_number(sums_[i]))
          out[i] = to_sample<T>(sums_[i], validity_);
        else
          whole_[col] = 0;  // doubles that overflow
      }
  }

  static bool is_number(Mean<T> value) { return value - value == 0; }

  /// One texel from what counts: the box says whether it holds data, and stands in where negative weights have more
  /// than a third of the positive ones.
  bool reduce_texel(std::int32_t x, std::int32_t y, const Taps& across, const Taps& down, T* out) {
    const bool held = texel_.reduce(x, y, out);
    if (!held) return false;
    for (std::size_t b = 0; b < static_cast<std::size_t>(pair_.type.data_bands()); ++b)
      if (texel_.held(b)) pair_.reduction.power ? weigh_power(b, across, down, out[b]) : weigh(b, across, down, out[b]);
    return true;
  }

  /// Calls `take(sample, weight)` for all samples of a band that count.
  template <class Take>
  void for_each(std::size_t b, const Taps& across, const Taps& down, Take&& take) const {
    const auto data_bands = static_cast<std::size_t>(pair_.type.data_bands());
    for (std::size_t j = 0; j < down.weights.size(); ++j) {
      const std::int32_t y = down.first + static_cast<std::int32_t>(j);
      const T* texel = samples_at<T>(fine_, pair_.type, across.first, y);
      const std::uint8_t* valid = valid_at(fine_, across.first, y);
      for (std::size_t i = 0; i < across.weights.size(); ++i, texel += bands_) {
        if (!validity_.texel(texel, valid ? valid + i : nullptr) || !validity_.sample(texel[b])) continue;
        long double weight = static_cast<long double>(down.weights[j]) * static_cast<long double>(across.weights[i]);
        if (pair_.type.alpha)
          weight *=
              static_cast<long double>(texel[data_bands]) / static_cast<long double>(mosaic::Validity<T>::opaque());
        if (std::abs(weight) <= std::numeric_limits<long double>::max()) take(texel[b], weight);
      }
    }
  }

  void weigh(std::size_t b, const Taps& across, const Taps& down, T& out) const {
    long double sum = 0, total = 0, size = 0;
    for_each(b, across, down, [&](T sample, long double weight) {
      sum += weight * static_cast<long double>(sample);
      total += weight;
      size += std::abs(weight);
    });
    if (total >= size / 2) out = to_sample<T>(static_cast<Mean<T>>(sum / total), validity_);
  }

  void weigh_power(std::size_t b, const Taps& across, const Taps& down, T& out) const {
    MeanOfPower power(pair_.reduction, b);
    long double total = 0, size = 0;
    for_each(b, across, down, [&](T sample, long double weight) {
      power.look_at(static_cast<double>(sample));
      total += weight;
      size += std::abs(weight);
    });
    if (total < size / 2) return;
    for_each(b, across, down, [&](T sample, long double weight) {
      power.add(static_cast<double>(sample), static_cast<double>(weight));
    });
    if (power.valid()) out = to_sample<T>(static_cast<Mean<T>>(power.mean()), validity_);
  }

  const LevelPair& pair_;
  const mosaic::Validity<T> validity_;
  const Block& fine_;
  Block& coarse_;
  CoveredTexel<T> texel_;
  const std::size_t bands_;
  std::vector<Taps> columns_, rows_;
  std::array<FilteredRow, 16> filtered_;  // more than any filter reaches over
  std::vector<Mean<T>> sums_;
  std::vector<std::uint8_t> whole_, texel_whole_;
};

}  // namespace

void reduce_by_kernel(const LevelPair& pair, const Block& fine, Block& coarse) {
  tiff::with_sample(pair.type.sample, [&]<class T>(T) { KernelFilter<T>(pair, fine, coarse).run(); });
}

}  // namespace nadir::pyramid

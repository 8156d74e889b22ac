#include "reduction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "box.h"
#include "nadir/mosaic/validity.h"
#include "parent.h"

namespace nadir::pyramid {
namespace {

using mosaic::is_whole, mosaic::Mean, mosaic::Validity, mosaic::samples_at, mosaic::to_sample, mosaic::valid_at;

/// A valid sample with its weight.
template <class T>
struct Weighted {
  T sample;
  Mean<T> weight;
};

template <class T>
Mean<T> weighted_mean(std::span<const Weighted<T>> samples) {
  Mean<T> sum = 0, total = 0;
  for (const auto& [sample, weight] : samples) {
    sum += weight * static_cast<Mean<T>>(sample);
    total += weight;
  }
  return sum / total;
}

/// 10 log10 of the mean of the powers of ten that decibels stand for. Relative to the greatest, so that nothing
/// overflows, and equal values give exactly that value.
template <class T>
Mean<T> mean_of_power(std::span<const Weighted<T>> samples, double scale, double offset) {
  double greatest = -std::numeric_limits<double>::infinity(), least = -greatest;
  for (const auto& s : samples) {
    const double decibels = static_cast<double>(s.sample) * scale + offset;
    greatest = std::max(greatest, decibels);
    least = std::min(least, decibels);
  }
  double sum = 0, total = 0;
  for (const auto& s : samples) {
    sum += static_cast<double>(s.weight) *
           std::pow(10.0, (static_cast<double>(s.sample) * scale + offset - greatest) / 10);
    total += static_cast<double>(s.weight);
  }
  // Negative lobes may leave no power: there is not less than the least.
  const double mean = sum > 0 ? std::max(least, greatest + 10 * std::log10(sum / total)) : least;
  return (mean - offset) / scale;
}

/// The value with the greatest weight; the least of those.
template <class T>
T mode(std::span<const Weighted<T>> samples) {
  T best{};
  Mean<T> most = -1;
  for (const auto& candidate : samples) {
    Mean<T> weight = 0;
    for (const auto& other : samples)
      if (other.sample == candidate.sample) weight += other.weight;
    // Sums of the same fractions in another order may differ in their last bits.
    const bool heavier = weight > most + Mean<T>(1e-9), alike = weight > most - Mean<T>(1e-9);
    if (heavier || (alike && candidate.sample < best)) {
      best = candidate.sample;
      most = std::max(most, weight);
    }
  }
  return best;
}

/// Reduces one window.
///
/// Texels all of whose samples count are filtered along columns, then along rows; all others one by one, with what
/// counts. Which way a texel goes depends on its own samples alone.
template <class T>
class WindowReducer {
 public:
  WindowReducer(const TexelType& type, const Reduction& reduction, const Block& fine, Block& coarse,
                std::vector<Taps> columns, std::vector<Taps> rows)
      : type_(type),
        reduction_(reduction),
        validity_(type),
        fine_(fine),
        coarse_(coarse),
        columns_(std::move(columns)),
        rows_(std::move(rows)),
        bands_(static_cast<std::size_t>(type.bands)) {}

  void run() {
    const bool separable =
        !reduction_.power && (reduction_.filter == Filter::Box || reduction_.filter == Filter::Gaussian ||
                              reduction_.filter == Filter::Lanczos);
    const Window& window = coarse_.window();
    std::vector<std::uint8_t> whole(static_cast<std::size_t>(window.width), 0);
    for (std::int32_t row = 0; row < window.height; ++row) {
      const Taps& taps = rows_[static_cast<std::size_t>(row)];
      if (separable) {
        filter_row(taps, row);
        find_whole(taps, whole);
      }
      for (std::int32_t col = 0; col < window.width; ++col)
        if (!whole[static_cast<std::size_t>(col)]) reduce_texel(col, row);
      if (coarse_.masked() && separable)
        for (std::int32_t col = 0; col < window.width; ++col)
          if (whole[static_cast<std::size_t>(col)]) coarse_.valid_row(window.y + row)[col] = 255;
    }
  }

 private:
  struct FilteredRow {
    std::int32_t y = -1;
    std::vector<Mean<T>> means;  // of each coarser column and band
    std::vector<std::uint8_t> whole;
  };

  /// A row of the finer level, filtered along its columns; kept as long as the next rows need it.
  const FilteredRow& filtered(std::int32_t y) {
    FilteredRow& row = filtered_[static_cast<std::size_t>(y) % filtered_.size()];
    if (row.y == y) return row;
    row.y = y;
    row.means.resize(columns_.size() * bands_);
    row.whole.assign(columns_.size(), 1);
    const Window& window = fine_.window();
    const T* samples = samples_at<T>(fine_, type_, window.x, y);
    if (!validity_.always()) {
      texel_whole_.resize(static_cast<std::size_t>(window.width));
      const std::uint8_t* valid = valid_at(fine_, window.x, y);
      for (std::int32_t x = 0; x < window.width; ++x)
        texel_whole_[static_cast<std::size_t>(x)] =
            validity_.whole(samples + static_cast<std::size_t>(x) * bands_, valid ? valid + x : nullptr);
    }
    for (std::size_t col = 0; col < columns_.size(); ++col) {
      const Taps& taps = columns_[col];
      const auto first = static_cast<std::size_t>(taps.first - window.x);
      Mean<T>* means = row.means.data() + col * bands_;
      for (std::size_t b = 0; b < bands_; ++b) {
        const T* from = samples + first * bands_ + b;
        Mean<T> mean = 0;
        for (std::size_t k = 0; k < taps.weights.size(); ++k, from += bands_)
          mean += static_cast<Mean<T>>(taps.weights[k]) * static_cast<Mean<T>>(*from);
        means[b] = mean;
      }
      if (!validity_.always())
        for (std::size_t k = 0; k < taps.weights.size(); ++k) row.whole[col] &= texel_whole_[first + k];
    }
    return row;
  }

  void filter_row(const Taps& taps, std::int32_t row) {
    const std::size_t samples = columns_.size() * bands_;
    sums_.assign(samples, 0);
    for (std::size_t k = 0; k < taps.weights.size(); ++k) {
      const FilteredRow& from = filtered(taps.first + static_cast<std::int32_t>(k));
      const auto weight = static_cast<Mean<T>>(taps.weights[k]);
      for (std::size_t i = 0; i < samples; ++i) sums_[i] += weight * from.means[i];
    }
    T* out = reinterpret_cast<T*>(coarse_.row(coarse_.window().y + row));
    for (std::size_t i = 0; i < samples; ++i) out[i] = to_sample<T>(sums_[i], validity_);
  }

  void find_whole(const Taps& taps, std::vector<std::uint8_t>& whole) {
    std::fill(whole.begin(), whole.end(), std::uint8_t{1});
    if (validity_.always()) return;
    for (std::size_t k = 0; k < taps.weights.size(); ++k) {
      const FilteredRow& from = filtered(taps.first + static_cast<std::int32_t>(k));
      for (std::size_t col = 0; col < whole.size(); ++col) whole[col] &= from.whole[col];
    }
  }

  T value_of(std::size_t band, std::span<const Weighted<T>> samples) const {
    if (reduction_.filter == Filter::Nearest) return samples.front().sample;
    if (reduction_.filter == Filter::Mode) return mode<T>(samples);
    if (!reduction_.power) return to_sample<T>(weighted_mean<T>(samples), validity_);
    const double scale = reduction_.scale.empty() ? 1 : reduction_.scale[band];
    const double offset = reduction_.offset.empty() ? 0 : reduction_.offset[band];
    return to_sample<T>(mean_of_power<T>(samples, scale, offset), validity_);
  }

  /// One texel from what counts of its samples.
  void reduce_texel(std::int32_t col, std::int32_t row) {
    const Taps& across = columns_[static_cast<std::size_t>(col)];
    const Taps& down = rows_[static_cast<std::size_t>(row)];
    const auto data_bands = static_cast<std::size_t>(type_.data_bands());
    const Window& window = coarse_.window();
    T* out = reinterpret_cast<T*>(coarse_.row(window.y + row)) + static_cast<std::size_t>(col) * bands_;
    bool any = false;
    for (std::size_t b = 0; b < data_bands; ++b) {
      gathered_.clear();
      for (std::size_t j = 0; j < down.weights.size(); ++j) {
        const std::int32_t y = down.first + static_cast<std::int32_t>(j);
        const T* texel = samples_at<T>(fine_, type_, across.first, y);
        const std::uint8_t* valid = valid_at(fine_, across.first, y);
        for (std::size_t i = 0; i < across.weights.size(); ++i, texel += bands_, valid += valid ? 1 : 0) {
          if (!validity_.texel(texel, valid) || !validity_.sample(texel[b])) continue;
          auto weight = static_cast<Mean<T>>(down.weights[j] * across.weights[i]);
          if (type_.alpha && reduction_.filter != Filter::Mode)
            weight *= static_cast<Mean<T>>(texel[data_bands]) / static_cast<Mean<T>>(Validity<T>::opaque());
          if (weight != 0) gathered_.push_back({texel[b], weight});
        }
      }
      // Negative lobes alone are no mean.
      Mean<T> total = 0;
      for (const auto& s : gathered_) total += s.weight;
      const bool valid = !gathered_.empty() && total > Mean<T>(1e-9);
      out[b] = valid ? value_of(b, gathered_) : nothing();
      any |= valid;
    }
    if (type_.alpha) out[data_bands] = any ? opacity(across, down) : T{};
    if (type_.alpha && out[data_bands] == T{}) std::fill_n(out, data_bands, nothing());
    if (coarse_.masked()) coarse_.valid_row(window.y + row)[col] = any ? 255 : 0;
  }

  /// Half a texel is half opaque.
  T opacity(const Taps& across, const Taps& down) {
    gathered_.clear();
    for (std::size_t j = 0; j < down.weights.size(); ++j) {
      const T* texel = samples_at<T>(fine_, type_, across.first, down.first + static_cast<std::int32_t>(j));
      for (std::size_t i = 0; i < across.weights.size(); ++i, texel += bands_)
        gathered_.push_back({texel[type_.data_bands()], static_cast<Mean<T>>(down.weights[j] * across.weights[i])});
    }
    if (reduction_.filter == Filter::Mode) return mode<T>(gathered_);
    return to_sample<T>(
        std::clamp<Mean<T>>(weighted_mean<T>(gathered_), 0, static_cast<Mean<T>>(Validity<T>::opaque())), validity_);
  }

  T nothing() const {
    if (validity_.has_nodata()) return validity_.nodata();
    const bool nan = type_.nodata.has_value() || (!type_.mask && !type_.alpha);
    return std::is_floating_point_v<T> && nan ? std::numeric_limits<T>::quiet_NaN() : T{};
  }

  const TexelType& type_;
  const Reduction& reduction_;
  const Validity<T> validity_;
  const Block& fine_;
  Block& coarse_;
  const std::vector<Taps> columns_, rows_;
  const std::size_t bands_;
  std::array<FilteredRow, 16> filtered_;  // more than any filter reaches over
  std::vector<Mean<T>> sums_;
  std::vector<std::uint8_t> texel_whole_;
  std::vector<Weighted<T>> gathered_;
};

}  // namespace

Window Reducer::needed(const Window& coarse) const {
  const auto reach = [&](std::int32_t fine, std::int32_t size, std::int32_t begin, std::int32_t end) {
    const auto first = taps(reduction_.filter, fine, size, begin, begin + 1).front();
    const auto last = taps(reduction_.filter, fine, size, end - 1, end).front();
    return std::pair(first.first, last.first + static_cast<std::int32_t>(last.weights.size()));
  };
  const auto [left, right] = reach(fine_.width, coarse_.width, coarse.x, coarse.x + coarse.width);
  const auto [top, bottom] = reach(fine_.height, coarse_.height, coarse.y, coarse.y + coarse.height);
  return {left, top, right - left, bottom - top};
}

Window Reducer::parents(const Window& fine) const {
  const std::int32_t x = parent(fine_.width, coarse_.width, fine.x), y = parent(fine_.height, coarse_.height, fine.y);
  return {x, y, parent(fine_.width, coarse_.width, fine.x + fine.width - 1) + 1 - x,
          parent(fine_.height, coarse_.height, fine.y + fine.height - 1) + 1 - y};
}

bool Reducer::is_plain_box() const {
  return reduction_.filter == Filter::Box && !reduction_.power && fine_.width == 2 * coarse_.width &&
         fine_.height == 2 * coarse_.height;
}

void Reducer::reduce(const Block& fine, Block& coarse) const {
  const Window& window = coarse.window();
  tiff::with_sample(type_.sample, [&]<class T>(T) {
    if constexpr (std::is_integral_v<T> && sizeof(T) <= 2) {
      if (is_plain_box() && !type_.nodata && is_whole<T>(type_, fine, needed(window))) {
        for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
          const T* top = samples_at<T>(fine, type_, 2 * window.x, 2 * y);
          const T* bottom = samples_at<T>(fine, type_, 2 * window.x, 2 * y + 1);
          T* out = reinterpret_cast<T*>(coarse.row(y));
          const auto texels = static_cast<std::size_t>(window.width), bands = static_cast<std::size_t>(type_.bands);
          if constexpr (std::is_same_v<T, std::uint8_t>)
            average_2x2(top, bottom, out, texels, bands);
          else
            scalar::average_2x2(top, bottom, out, texels, bands);
          if (coarse.masked()) std::memset(coarse.valid_row(y), 255, texels);
        }
        return;
      }
    }
    WindowReducer<T>(type_, reduction_, fine, coarse,
                     taps(reduction_.filter, fine_.width, coarse_.width, window.x, window.x + window.width),
                     taps(reduction_.filter, fine_.height, coarse_.height, window.y, window.y + window.height))
        .run();
  });
}

}  // namespace nadir::pyramid

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "axis.h"
#include "nadir/mosaic/validity.h"
#include "reduction.h"
#include "whole.h"

namespace nadir::pyramid {

/// Two neighbouring levels, and how the coarser is made.
struct LevelPair {
  const TexelType& type;
  const Reduction& reduction;
  Axis x, y;
};

/// What a coarser sample may become where nothing is valid in it: what mosaic::clear writes.
template <class T>
T hole(const TexelType& type, const mosaic::Validity<T>& validity) {
  if (validity.has_nodata()) return validity.nodata();
  const bool nan = type.nodata.has_value() || (!type.mask && !type.alpha);
  return std::is_floating_point_v<T> && nan ? std::numeric_limits<T>::quiet_NaN() : T{};
}

/// Rows of the finer level that texels x to x + `texels` of row y of the coarser one cover; the centres' row alone
/// where the nearest texel is taken.
template <class T>
struct CoveredRows {
  CoveredRows(const LevelPair& pair, const Block& fine, std::int32_t x, std::int32_t y, std::int32_t texels) {
    const bool nearest = pair.reduction.filter == Filter::Nearest;
    const Cover first = pair.x.cover(x), last = pair.x.cover(x + texels - 1), down = pair.y.cover(y);
    left = nearest ? 2 * x : first.first;
    const std::int32_t right = nearest ? 2 * (x + texels) - 1 : last.first + last.count;
    columns = static_cast<std::size_t>(right - left);
    count = nearest ? 1 : static_cast<std::size_t>(down.count);
    const std::int32_t top = nearest ? Axis::centre(y) : down.first;
    for (std::size_t k = 0; k < count; ++k) {
      samples[k] = mosaic::samples_at<T>(fine, pair.type, left, top + static_cast<std::int32_t>(k));
      valid[k] = mosaic::valid_at(fine, left, top + static_cast<std::int32_t>(k));
    }
  }

  bool all_whole(const TexelType& type, const mosaic::Validity<T>& validity) const {
    for (std::size_t k = 0; k < count; ++k)
      if (!is_whole(type, validity, samples[k], valid[k], columns)) return false;
    return true;
  }
  bool all_void(const TexelType& type, const mosaic::Validity<T>& validity) const {
    for (std::size_t k = 0; k < count; ++k)
      if (!is_void(type, validity, samples[k], valid[k], columns)) return false;
    return true;
  }

  std::array<const T*, 3> samples = {};
  std::array<const std::uint8_t*, 3> valid = {};
  std::int32_t left = 0;
  std::size_t columns = 0, count = 0;
};

/// Makes decibels of powers: a sample with its weight is added twice, to find the greatest and to sum relative to it,
/// so that nothing overflows or vanishes, and equal samples give exactly that sample. Offsets cancel out.
class MeanOfPower {
 public:
  MeanOfPower(const Reduction& reduction, std::size_t band)
      : scale_(reduction.scale.empty() ? 1 : reduction.scale[band]) {}

  void look_at(double sample) {
    least_ = count_ == 0 || sample < least_ ? sample : least_;
    greatest_ = count_ == 0 || sample > greatest_ ? sample : greatest_;
    ++count_;
  }
  void add(double sample, double weight) {
    constexpr double octaves_per_decibel = 0.33219280948873623;  // log2(10) / 10
    const double top = scale_ < 0 ? least_ : greatest_;
    sum_ += sample == top ? weight : weight * std::exp2((sample - top) * scale_ * octaves_per_decibel);
    total_ += weight;
  }
  bool valid() const { return sum_ > 0 && total_ > 0; }  // negative lobes may leave no power
  double mean() const {
    constexpr double decibels_per_octave = 3.0102999566398120;  // 10 log10(2)
    const double top = scale_ < 0 ? least_ : greatest_;
    if (scale_ == 0 || sum_ == total_) return top;
    return top + std::log2(sum_ / total_) * decibels_per_octave / scale_;
  }

 private:
  double scale_, least_ = 0, greatest_ = 0, sum_ = 0, total_ = 0;
  std::int64_t count_ = 0;
};

/// A coarser texel from those of the finer level that it covers, whatever their validity: the definition.
template <class T>
class CoveredTexel {
 public:
  CoveredTexel(const LevelPair& pair, const Block& fine)
      : pair_(pair),
        validity_(pair.type),
        fine_(fine),
        bands_(static_cast<std::size_t>(pair.type.bands)),
        data_bands_(static_cast<std::size_t>(pair.type.data_bands())),
        hole_(hole(pair.type, validity_)),
        held_(data_bands_) {}

  /// Makes texel (i, j). Returns whether it holds data.
  bool reduce(std::int32_t i, std::int32_t j, T* out) {
    const bool nearest = pair_.reduction.filter == Filter::Nearest;
    collect(nearest ? Cover{Axis::centre(i), 1, {1}} : pair_.x.cover(i),
            nearest ? Cover{Axis::centre(j), 1, {1}} : pair_.y.cover(j));
    bool any = false;
    for (std::size_t b = 0; b < data_bands_; ++b) {
      held_[b] = reduce_band(b, out[b]);
      any |= held_[b] != 0;
    }
    if (pair_.type.alpha) {
      out[data_bands_] = any ? opacity() : T{};
      any = out[data_bands_] != T{};
    }
    for (std::size_t b = 0; b < data_bands_; ++b) {
      if (any && held_[b]) continue;
      const bool others_hold = any && std::is_floating_point_v<T> && !validity_.has_nodata();
      out[b] = others_hold ? std::numeric_limits<T>::quiet_NaN() : hole_;
      held_[b] = 0;
    }
    return any;
  }

  /// Makes `texels` texels under which nothing counts. `valid`: null without a mask.
  void fill_with_nothing(T* out, std::uint8_t* valid, std::size_t texels) const {
    std::fill_n(out, texels * bands_, hole_);
    for (std::size_t k = 0; pair_.type.alpha && k < texels; ++k) out[(k + 1) * bands_ - 1] = T{};
    if (valid) std::fill_n(valid, texels, std::uint8_t{0});
  }

  /// Whether a data band of the last texel holds data.
  bool held(std::size_t band) const { return held_[band] != 0; }

 private:
  struct Part {
    const T* texel = nullptr;    // null: it does not count
    mosaic::Mean<T> weight = 1;  // by opacity
    bool masked = false;
  };

  void collect(const Cover& across, const Cover& down) {
    across_ = across;
    down_ = down;
    T first{};
    bool alike = true;
    for (int dy = 0; dy < down.count; ++dy) {
      const T* texel = mosaic::samples_at<T>(fine_, pair_.type, across.first, down.first + dy);
      const std::uint8_t* valid = mosaic::valid_at(fine_, across.first, down.first + dy);
      for (int dx = 0; dx < across.count; ++dx, texel += bands_) {
        Part& part = part_at(dx, dy);
        part = {texel, 1, valid && valid[dx] == 0};
        texels_[at(dx, dy)] = texel;
        if (!validity_.texel(texel, valid ? valid + dx : nullptr)) part.texel = nullptr;
        if (!pair_.type.alpha || !part.texel) continue;
        const T alpha = texel[data_bands_];
        if constexpr (std::is_floating_point_v<T>)
          if (!std::isfinite(alpha)) {
            part.texel = nullptr;
            continue;
          }
        if (first == T{}) first = alpha;
        alike &= alpha == first;
        part.weight = static_cast<mosaic::Mean<T>>(alpha);
      }
    }
    blended_ = pair_.type.alpha && !alike && pair_.reduction.filter != Filter::Mode;
    if (!blended_)
      for (Part& part : parts_) part.weight = 1;  // the same bits as where there is no alpha
  }

  bool reduce_band(std::size_t b, T& out) {
    if (pair_.reduction.filter == Filter::Mode) return mode(b, out);
    if (pair_.reduction.filter == Filter::Nearest) {
      const T* texel = parts_[0].texel;
      if (!texel || !validity_.sample(texel[b])) return false;
      out = texel[b];
      return true;
    }
    if (pair_.reduction.power) return mean_of_power(b, out);
    if constexpr (std::is_integral_v<T> && sizeof(T) == 8)
      return blended_ ? mean<long double>(b, out) : exact_mean(b, out);
    else
      return mean<double>(b, out);
  }

  /// Columns first, then their sum: kernels add in this order.
  template <class Real>
  bool mean(std::size_t b, T& out) const {
    Real sum = 0, total = 0;
    for (int dx = 0; dx < across_.count; ++dx) {
      Real column = 0, weights = 0;
      for (int dy = 0; dy < down_.count; ++dy) {
        const Part& part = part_at(dx, dy);
        if (!part.texel || !validity_.sample(part.texel[b])) continue;
        const Real weight = static_cast<Real>(down_.parts[static_cast<std::size_t>(dy)]) * Real(part.weight);
        column += weight * static_cast<Real>(part.texel[b]);
        weights += weight;
      }
      const Real part = static_cast<Real>(across_.parts[static_cast<std::size_t>(dx)]);
      sum += part * column;
      total += part * weights;
    }
    if (!(total > 0)) return false;
    if constexpr (std::is_same_v<T, double> && std::is_same_v<Real, double>)
      if (!std::isfinite(sum) || !std::isfinite(total)) return mean<long double>(b, out);  // it has a wider exponent
    out = mosaic::to_sample<T>(static_cast<mosaic::Mean<T>>(sum / total), validity_);
    return true;
  }

  /// Whole numbers all the way: weights reach 2^62 together, samples 2^64.
  bool exact_mean(std::size_t b, T& out) const {
    __int128 sum = 0, total = 0;
    for (int dx = 0; dx < across_.count; ++dx)
      for (int dy = 0; dy < down_.count; ++dy) {
        const Part& part = part_at(dx, dy);
        if (!part.texel || !validity_.sample(part.texel[b])) continue;
        const __int128 weight = static_cast<__int128>(across_.parts[static_cast<std::size_t>(dx)]) *
                                static_cast<__int128>(down_.parts[static_cast<std::size_t>(dy)]);
        sum += weight * static_cast<__int128>(part.texel[b]);
        total += weight;
      }
    if (total == 0) return false;
    __int128 below = sum / total;
    if (below * total > sum) --below;
    const __int128 rest = sum - below * total;
    out = static_cast<T>(2 * rest >= total ? below + 1 : below);
    if (validity_.has_nodata() && out == validity_.nodata()) {
      const bool down = 2 * rest >= total ? out != std::numeric_limits<T>::min() : out == std::numeric_limits<T>::max();
      out = static_cast<T>(down ? out - 1 : out + 1);
    }
    return true;
  }

  template <class Take>
  void for_each_valid(std::size_t b, Take&& take) const {
    for (int dx = 0; dx < across_.count; ++dx)
      for (int dy = 0; dy < down_.count; ++dy) {
        const Part& part = part_at(dx, dy);
        if (!part.texel || !validity_.sample(part.texel[b])) continue;
        take(part.texel[b], across_.parts[static_cast<std::size_t>(dx)] *
                                (down_.parts[static_cast<std::size_t>(dy)] * static_cast<double>(part.weight)));
      }
  }

  bool mean_of_power(std::size_t b, T& out) const {
    MeanOfPower power(pair_.reduction, b);
    for_each_valid(b, [&](T sample, double) { power.look_at(static_cast<double>(sample)); });
    for_each_valid(b, [&](T sample, double weight) { power.add(static_cast<double>(sample), weight); });
    if (!power.valid()) return false;
    out = mosaic::to_sample<T>(static_cast<mosaic::Mean<T>>(power.mean()), validity_);
    return true;
  }

  bool mode(std::size_t b, T& out) const {
    std::array<T, 9> values;
    std::array<double, 9> areas;
    std::size_t count = 0;
    for_each_valid(b, [&](T sample, double area) {
      const auto found =
          static_cast<std::size_t>(std::find(values.begin(), values.begin() + count, sample) - values.begin());
      if (found == count) {
        values[count] = sample;
        areas[count++] = area;
      } else {
        areas[found] += area;
      }
    });
    if (count == 0) return false;
    std::size_t best = 0;
    for (std::size_t k = 1; k < count; ++k)
      if (areas[k] > areas[best] || (areas[k] == areas[best] && values[k] < values[best])) best = k;
    out = values[best];
    return true;
  }

  /// Half a texel is half opaque.
  T opacity() const {
    using Real = mosaic::Mean<T>;
    if (pair_.reduction.filter == Filter::Nearest) return texels_[0][data_bands_];
    Real sum = 0, total = 0;
    for (int dx = 0; dx < across_.count; ++dx) {
      Real column = 0, weights = 0;
      for (int dy = 0; dy < down_.count; ++dy) {
        if (part_at(dx, dy).masked) continue;
        const Real weight = static_cast<Real>(down_.parts[static_cast<std::size_t>(dy)]);
        if (part_at(dx, dy).texel) column += weight * static_cast<Real>(texels_[at(dx, dy)][data_bands_]);
        weights += weight;
      }
      const Real part = static_cast<Real>(across_.parts[static_cast<std::size_t>(dx)]);
      sum += part * column;
      total += part * weights;
    }
    return mosaic::to_sample<T>(sum / total, opacity_rule_);
  }

  static std::size_t at(int dx, int dy) { return static_cast<std::size_t>(3 * dx + dy); }
  Part& part_at(int dx, int dy) { return parts_[at(dx, dy)]; }
  const Part& part_at(int dx, int dy) const { return parts_[at(dx, dy)]; }

  const LevelPair& pair_;
  const mosaic::Validity<T> validity_;
  const mosaic::Validity<T> opacity_rule_{TexelType{}};  // alpha knows no nodata
  const Block& fine_;
  const std::size_t bands_, data_bands_;
  const T hole_;
  std::vector<std::uint8_t> held_;
  Cover across_, down_;
  std::array<Part, 9> parts_;
  std::array<const T*, 9> texels_;
  bool blended_ = false;
};

}  // namespace nadir::pyramid

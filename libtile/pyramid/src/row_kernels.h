#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "axis.h"

namespace nadir::pyramid {

/// Sums of two or three rows by their weights, in double: columns of what a coarser row covers.
template <class T>
struct SumRows {
  [[gnu::always_inline]] static void run(const T* const* rows, const double* weights, int count, double* sums,
                                         std::size_t samples) {
    const T *a = rows[0], *b = rows[1], *c = rows[2];
    const double u = weights[0], v = weights[1], w = weights[2];
    if (count == 1)
      for (std::size_t i = 0; i < samples; ++i) sums[i] = u * static_cast<double>(a[i]);
    else if (count == 2)
      for (std::size_t i = 0; i < samples; ++i) sums[i] = u * static_cast<double>(a[i]) + v * static_cast<double>(b[i]);
    else
      for (std::size_t i = 0; i < samples; ++i)
        sums[i] = u * static_cast<double>(a[i]) + v * static_cast<double>(b[i]) + w * static_cast<double>(c[i]);
  }
};

/// Every second texel of a row in one row of doubles, those between in another.
template <class T>
struct SplitPairs {
  template <std::size_t Bands>
  [[gnu::always_inline]] static void run_bands(const T* row, double* __restrict first, double* __restrict second,
                                               std::size_t pairs, std::size_t any_bands) {
    const std::size_t bands = Bands == 0 ? any_bands : Bands;
    for (std::size_t i = 0; i < pairs; ++i)
      for (std::size_t b = 0; b < bands; ++b) {
        first[i * bands + b] = static_cast<double>(row[2 * i * bands + b]);
        second[i * bands + b] = static_cast<double>(row[(2 * i + 1) * bands + b]);
      }
  }
  [[gnu::always_inline]] static void run(const T* row, double* first, double* second, std::size_t pairs,
                                         std::size_t bands) {
    if (bands == 1) return run_bands<1>(row, first, second, pairs, 1);
    if (bands == 3) return run_bands<3>(row, first, second, pairs, 3);
    run_bands<0>(row, first, second, pairs, bands);
  }
};

/// Sums of any rows of doubles by their weights, first to last.
struct WeighRows {
  template <std::size_t Count>
  [[gnu::always_inline]] static void run_count(const double* const* rows, const double* weights, std::size_t any_count,
                                               double* __restrict sums, std::size_t samples) {
    const std::size_t count = Count == 0 ? any_count : Count;
    for (std::size_t i = 0; i < samples; ++i) {
      double sum = 0;
      for (std::size_t k = 0; k < count; ++k) sum += weights[k] * rows[k][i];
      sums[i] = sum;
    }
  }
  [[gnu::always_inline]] static void run(const double* const* rows, const double* weights, std::size_t count,
                                         double* sums, std::size_t samples) {
    if (count == 12) return run_count<12>(rows, weights, count, sums, samples);
    if (count == 6) return run_count<6>(rows, weights, count, sums, samples);
    run_count<0>(rows, weights, count, sums, samples);
  }
};

/// As WeighRows, but each sample with weights of its own, those of row k from weights[k * samples] on.
struct WeighColumns {
  template <std::size_t Count>
  [[gnu::always_inline]] static void run_count(const double* const* rows, const double* weights, std::size_t any_count,
                                               double* __restrict sums, std::size_t samples) {
    const std::size_t count = Count == 0 ? any_count : Count;
    for (std::size_t i = 0; i < samples; ++i) {
      double sum = 0;
      for (std::size_t k = 0; k < count; ++k) sum += weights[k * samples + i] * rows[k][i];
      sums[i] = sum;
    }
  }
  [[gnu::always_inline]] static void run(const double* const* rows, const double* weights, std::size_t count,
                                         double* sums, std::size_t samples) {
    if (count == 12) return run_count<12>(rows, weights, count, sums, samples);
    if (count == 11) return run_count<11>(rows, weights, count, sums, samples);
    run_count<0>(rows, weights, count, sums, samples);
  }
};

/// The integers of at most 16 bits that are nearest to means, halves up, within their type.
template <class T>
struct RoundMeans {
  [[gnu::always_inline]] static void run(const double* means, T* out, std::size_t samples) {
    constexpr double least = std::numeric_limits<T>::lowest(), most = std::numeric_limits<T>::max();
    for (std::size_t i = 0; i < samples; ++i)
      out[i] = static_cast<T>(static_cast<std::int32_t>(std::min(std::max(std::floor(means[i] + 0.5), least), most)));
  }
};

/// Means of sums of rows (SumRows) over the columns that each of `texels` coarser texels from `first` on covers. `sums`
/// begin with the finer column `left`. Operations are those of CoveredTexel::mean, in its order.
template <class T>
struct MeanOfColumns {
  struct Row {
    Axis axis;
    std::int32_t first, left;
    double rows_weight;  // sum of the rows' weights
  };

  [[gnu::always_inline]] static T rounded(double mean) {
    if constexpr (std::is_floating_point_v<T>)
      return static_cast<T>(mean + 0.0);  // one zero, not two
    else if constexpr (sizeof(T) >= 4)
      return static_cast<T>(static_cast<std::int64_t>(std::floor(mean + 0.5)));
    else if constexpr (std::is_unsigned_v<T>)
      return static_cast<T>(static_cast<std::int32_t>(mean + 0.5));
    else
      return static_cast<T>(static_cast<std::int32_t>(std::floor(mean + 0.5)));
  }

  template <std::size_t Bands>
  [[gnu::always_inline]] static void run_bands(const Row& row, const double* sums, T* out, std::size_t texels,
                                               std::size_t any_bands) {
    const std::size_t bands = Bands == 0 ? any_bands : Bands;
    for (std::size_t k = 0; k < texels; ++k, out += bands) {
      const std::int32_t i = row.first + static_cast<std::int32_t>(k);
      if (row.axis.halved()) {
        const double total = row.rows_weight + row.rows_weight;
        const double* at = sums + static_cast<std::size_t>(2 * i - row.left) * bands;
        for (std::size_t b = 0; b < bands; ++b) out[b] = rounded((at[b] + at[bands + b]) / total);
        continue;
      }
      // Weights of what lies beyond the level are 0: any sample will do.
      const double u = i, v = row.axis.coarse, w = row.axis.coarse - 1 - i;
      const double total = u * row.rows_weight + v * row.rows_weight + w * row.rows_weight;
      const double* at = sums + static_cast<std::size_t>(2 * i - row.left) * bands;
      const double* before = i > 0 ? at - bands : at;
      const double* behind = i < row.axis.coarse - 1 ? at + bands : at;
      for (std::size_t b = 0; b < bands; ++b) out[b] = rounded((u * before[b] + v * at[b] + w * behind[b]) / total);
    }
  }

  [[gnu::always_inline]] static void run(Row row, const double* sums, T* out, std::size_t texels, std::size_t bands) {
    if (bands == 1) return run_bands<1>(row, sums, out, texels, 1);
    if (bands == 3) return run_bands<3>(row, sums, out, texels, 3);
    if (bands == 4) return run_bands<4>(row, sums, out, texels, 4);
    run_bands<0>(row, sums, out, texels, bands);
  }
};

/// Every second texel of a row, from the first on.
template <class T>
struct EverySecond {
  template <std::size_t Bands>
  [[gnu::always_inline]] static void run_bands(const T* row, T* out, std::size_t texels, std::size_t any_bands) {
    const std::size_t bands = Bands == 0 ? any_bands : Bands;
    for (std::size_t i = 0; i < texels; ++i)
      for (std::size_t b = 0; b < bands; ++b) out[i * bands + b] = row[2 * i * bands + b];
  }
  [[gnu::always_inline]] static void run(const T* row, T* out, std::size_t texels, std::size_t bands) {
    if (bands == 1) return run_bands<1>(row, out, texels, 1);
    if (bands == 3) return run_bands<3>(row, out, texels, 3);
    run_bands<0>(row, out, texels, bands);
  }
};

/// The most frequent of 2x2 integers, the least of those.
template <class T>
struct ModeOf4 {
  template <std::size_t Bands>
  [[gnu::always_inline]] static void run_bands(const T* top, const T* bottom, T* out, std::size_t texels,
                                               std::size_t any_bands) {
    const std::size_t bands = Bands == 0 ? any_bands : Bands;
    for (std::size_t i = 0; i < texels; ++i)
      for (std::size_t band = 0; band < bands; ++band) {
        const std::size_t at = 2 * i * bands + band;
        T a = top[at], b = top[at + bands], c = bottom[at], d = bottom[at + bands];
        const auto sort = [](T & low, T & high) __attribute__((always_inline)) {
          const T less = std::min(low, high), more = std::max(low, high);
          low = less;
          high = more;
        };
        sort(a, b);
        sort(c, d);
        sort(a, c);
        sort(b, d);
        sort(b, c);
        // In order: equals are neighbours, and of two pairs the lesser comes first.
        const T upper = c == d ? c : a, middle = b == c ? b : upper;
        out[i * bands + band] = a == b ? a : middle;
      }
  }
  [[gnu::always_inline]] static void run(const T* top, const T* bottom, T* out, std::size_t texels, std::size_t bands) {
    if (bands == 1) return run_bands<1>(top, bottom, out, texels, 1);
    run_bands<0>(top, bottom, out, texels, bands);
  }
};

}  // namespace nadir::pyramid

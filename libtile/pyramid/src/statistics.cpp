#include "statistics.h"

#include <algorithm>
#include <cmath>

#include "whole.h"

namespace nadir::pyramid {
namespace {

using mosaic::samples_at, mosaic::valid_at;

template <class T>
constexpr bool is_byte = std::is_integral_v<T> && sizeof(T) == 1;
template <class T>
constexpr bool is_small = std::is_integral_v<T> && sizeof(T) <= 2;

/// Sums of powers of samples of a column: of small integers, less the least of their type, as what they are.
template <class T>
using Sum = std::conditional_t<is_small<T>, std::conditional_t<sizeof(T) == 1, std::uint32_t, std::uint64_t>,
                               std::conditional_t<sizeof(T) <= 4, double, long double>>;  // long double: 64-bit
                                                                                          // integers, and no overflow

constexpr std::int32_t rows_of_bytes = (1 << 16) - 8;  // whose squares, 255^2 at most, fit 32 bits with those of 8 more

template <class T>
[[gnu::always_inline]] inline Sum<T> value_of(T sample) {
  if constexpr (is_small<T>)
    return static_cast<Sum<T>>(std::int32_t{sample} - std::numeric_limits<T>::min());
  else
    return static_cast<Sum<T>>(sample);
}

/// Adds a row to its columns: the order of additions is that of rows, whatever the kernel.
template <class T>
struct AddRow {
  [[gnu::always_inline]] static void run(const T* row, Sum<T>* sums, Sum<T>* squares, T* least, T* greatest,
                                         std::size_t samples) {
    for (std::size_t i = 0; i < samples; ++i) {
      const Sum<T> value = value_of(row[i]);
      sums[i] += value;
      if constexpr (is_small<T>) squares[i] += value * value;
    }
    for (std::size_t i = 0; i < samples; ++i) {
      least[i] = std::min(least[i], row[i]);
      greatest[i] = std::max(greatest[i], row[i]);
    }
  }
};

/// Adds some rows of bytes, `stride` apart, at once: columns' sums are loaded and stored a few times less.
template <class T>
struct AddRowsOfBytes {
  static constexpr std::int32_t rows = 8;  // sums of so many bytes fit 16 bits

  [[gnu::always_inline]] static void run(const T* first, std::size_t stride, Sum<T>* __restrict sums,
                                         Sum<T>* __restrict squares, T* __restrict least, T* __restrict greatest,
                                         std::size_t samples) {
    for (std::size_t i = 0; i < samples; ++i) {
      std::uint16_t sum = 0;
      std::uint32_t square = 0;
      T low = least[i], high = greatest[i];
      for (std::size_t k = 0; k < rows; ++k) {
        const T sample = first[k * stride + i];
        const auto value = static_cast<std::uint16_t>(value_of(sample));
        sum = static_cast<std::uint16_t>(sum + value);
        square += static_cast<std::uint16_t>(value * value);
        low = std::min(low, sample);
        high = std::max(high, sample);
      }
      sums[i] += sum;
      squares[i] += square;
      least[i] = low;
      greatest[i] = high;
    }
  }
};

/// Adds squares of differences from the means of columns' bands.
template <class T>
struct AddDifferences {
  [[gnu::always_inline]] static void run(const T* row, const Sum<T>* means, Sum<T>* squares, std::size_t samples) {
    for (std::size_t i = 0; i < samples; ++i) {
      const Sum<T> d = value_of(row[i]) - means[i];
      squares[i] += d * d;
    }
  }
};

template <class T>
class WindowStatistics {
 public:
  WindowStatistics(const TexelType& type, const Block& block, const Window& window)
      : type_(type),
        validity_(type),
        block_(block),
        window_(window),
        bands_(static_cast<std::size_t>(type.bands)),
        columns_(static_cast<std::size_t>(window.width)),
        samples_(columns_ * bands_),
        sums_(samples_),
        squares_(samples_),
        least_(samples_, std::numeric_limits<T>::max()),
        greatest_(samples_, std::numeric_limits<T>::lowest()),
        counts_(samples_),
        bands_found_(bands_) {}

  std::vector<BandStatistics> run() {
    const std::int32_t end = window_.y + window_.height;
    for (std::int32_t y = window_.y, since_collected = 0, rows = 0; y < end; y += rows) {
      rows = add_rows(y, end);
      since_collected += rows;
      if (since_collected < rows_of_bytes) continue;
      collect();
      since_collected = 0;
    }
    collect();
    if constexpr (!is_small<T>) add_differences();
    std::vector<BandStatistics> all(static_cast<std::size_t>(type_.data_bands()));
    for (std::size_t b = 0; b < all.size(); ++b) all[b] = result(bands_found_[b]);
    return all;
  }

 private:
  using Total = std::conditional_t<is_small<T>, std::uint64_t, Sum<T>>;
  struct Found {
    std::uint64_t count = 0;
    T least = std::numeric_limits<T>::max(), greatest = std::numeric_limits<T>::lowest();
    Total sum = 0, squares = 0;
  };

  const T* row_at(std::int32_t y) const { return samples_at<T>(block_, type_, window_.x, y); }

  bool whole(std::int32_t y) const {
    const T* row = row_at(y);
    return is_whole(type_, validity_, row, valid_at(block_, window_.x, y), columns_) && all_finite(row, samples_);
  }

  /// Calls `add(i, band)` for each sample of a row that counts.
  template <class Add>
  void for_each_valid(std::int32_t y, Add&& add) {
    const T* row = row_at(y);
    const std::uint8_t* valid = valid_at(block_, window_.x, y);
    if (is_void(type_, validity_, row, valid, columns_)) return;
    find_valid(validity_, type_, row, valid, columns_, counts_.data());
    for (std::size_t x = 0, i = 0; x < columns_; ++x)
      for (std::size_t b = 0; b < bands_; ++b, ++i)
        if (counts_[i]) add(i, b);
  }

  /// Adds the row `y`, and others behind it that are whole too. How many.
  std::int32_t add_rows(std::int32_t y, std::int32_t end) {
    constexpr std::int32_t most = is_byte<T> ? AddRowsOfBytes<T>::rows : 1;
    std::int32_t rows = 0;
    while (rows < std::min(most, end - y) && whole(y + rows)) ++rows;
    const T* row = row_at(y);
    if (rows == 0) {
      for_each_valid(y, [&](std::size_t i, std::size_t b) {
        AddRow<T>::run(row + i, &sums_[i], &squares_[i], &least_[i], &greatest_[i], 1);
        ++bands_found_[b].count;
      });
      return 1;
    }
    for (Found& band : bands_found_) band.count += columns_ * static_cast<std::size_t>(rows);
    if constexpr (is_byte<T>)
      if (rows == most) {
        pyramid::run<AddRowsOfBytes<T>>(row, block_.row_bytes(), sums_.data(), squares_.data(), least_.data(),
                                        greatest_.data(), samples_);
        return rows;
      }
    for (std::int32_t k = 0; k < rows; ++k)
      pyramid::run<AddRow<T>>(row_at(y + k), sums_.data(), squares_.data(), least_.data(), greatest_.data(), samples_);
    return rows;
  }

  void collect() {
    for (std::size_t x = 0, i = 0; x < columns_; ++x)
      for (std::size_t b = 0; b < bands_; ++b, ++i) {
        Found& band = bands_found_[b];
        band.sum += sums_[i];
        band.squares += squares_[i];
        band.least = std::min(band.least, least_[i]);
        band.greatest = std::max(band.greatest, greatest_[i]);
      }
    std::fill(sums_.begin(), sums_.end(), Sum<T>{});
    std::fill(squares_.begin(), squares_.end(), Sum<T>{});
  }

  void add_differences() {
    std::vector<Sum<T>> means(samples_);
    for (std::size_t i = 0; i < samples_; ++i) {
      const Found& band = bands_found_[i % bands_];
      means[i] = band.count == 0 ? 0 : band.sum / static_cast<Sum<T>>(band.count);
    }
    for (std::int32_t y = window_.y; y < window_.y + window_.height; ++y) {
      const T* row = row_at(y);
      if (whole(y))
        pyramid::run<AddDifferences<T>>(row, static_cast<const Sum<T>*>(means.data()), squares_.data(), samples_);
      else
        for_each_valid(
            y, [&](std::size_t i, std::size_t) { AddDifferences<T>::run(row + i, &means[i], &squares_[i], 1); });
    }
    for (std::size_t i = 0; i < samples_; ++i) bands_found_[i % bands_].squares += squares_[i];
  }

  static BandStatistics result(const Found& band) {
    if (band.count == 0) return {};
    const auto n = static_cast<long double>(band.count);
    BandStatistics s{band.count, static_cast<double>(band.least), static_cast<double>(band.greatest), 0, 0};
    if constexpr (is_small<T>) {
      // Whole numbers below 2^128: no digit is lost where the squares' sum and the mean's square are alike.
      const auto sum = static_cast<unsigned __int128>(band.sum);
      const unsigned __int128 scatter = static_cast<unsigned __int128>(band.squares) * band.count - sum * sum;
      s.mean = static_cast<double>(static_cast<long double>(band.sum) / n + std::numeric_limits<T>::min());
      s.sum_of_squares = static_cast<double>(static_cast<long double>(scatter) / n);
    } else {
      s.mean = static_cast<double>(static_cast<long double>(band.sum) / n);
      s.sum_of_squares = static_cast<double>(
          std::min<long double>(static_cast<long double>(band.squares), std::numeric_limits<double>::max()));
    }
    return s;
  }

  const TexelType& type_;
  const mosaic::Validity<T> validity_;
  const Block& block_;
  const Window window_;
  const std::size_t bands_, columns_, samples_;
  std::vector<Sum<T>> sums_, squares_;  // a column and band each
  std::vector<T> least_, greatest_;
  std::vector<std::uint8_t> counts_;
  std::vector<Found> bands_found_;
};

}  // namespace

void BandStatistics::add(const BandStatistics& other) {
  if (other.count == 0) return;
  if (count == 0) {
    *this = other;
    return;
  }
  // Wider than a double, so that no square of a difference overflows.
  const auto n = static_cast<long double>(count), m = static_cast<long double>(other.count);
  const long double difference = static_cast<long double>(other.mean) - static_cast<long double>(mean);
  const long double squares = static_cast<long double>(sum_of_squares) +
                              static_cast<long double>(other.sum_of_squares) +
                              difference * difference * (n * m / (n + m));
  minimum = std::min(minimum, other.minimum);
  maximum = std::max(maximum, other.maximum);
  mean = static_cast<double>(static_cast<long double>(mean) + difference * (m / (n + m)));
  sum_of_squares = static_cast<double>(std::min<long double>(squares, std::numeric_limits<double>::max()));
  count += other.count;
}

std::vector<BandStatistics> statistics(const TexelType& type, const Block& block, const Window& window) {
  return tiff::with_sample(type.sample, [&]<class T>(T) { return WindowStatistics<T>(type, block, window).run(); });
}

bool empty(const TexelType& type, const Block& block, const Window& window) {
  if (!type.mask && !type.alpha && !type.nodata) return false;
  return tiff::with_sample(type.sample, [&]<class T>(T) {
    const mosaic::Validity<T> validity(type);
    const bool nan_is_nodata = type.nodata && std::isnan(*type.nodata);
    const auto holds_data = [&](T sample) {
      if (nan_is_nodata) return sample == sample;
      return !validity.has_nodata() || sample != validity.nodata();
    };
    for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
      const T* texel = samples_at<T>(block, type, window.x, y);
      const std::uint8_t* valid = valid_at(block, window.x, y);
      if (is_hidden(type, validity, texel, valid, static_cast<std::size_t>(window.width))) continue;
      for (std::int32_t x = 0; x < window.width; ++x, texel += type.bands) {
        if (!validity.texel(texel, valid ? valid + x : nullptr)) continue;
        if (std::any_of(texel, texel + type.data_bands(), holds_data)) return false;
      }
    }
    return true;
  });
}

}  // namespace nadir::pyramid

#include "statistics.h"

#include <algorithm>

#include "nadir/mosaic/validity.h"

namespace nadir::pyramid {
namespace {

using mosaic::Validity, mosaic::samples_at, mosaic::valid_at;

/// Bytes and 16-bit integers that are all valid: sums are whole numbers, and go column by column, which is fast.
template <class T>
std::vector<BandStatistics> of_small_integers(const TexelType& type, const Block& block, const Window& window) {
  using Sum = std::conditional_t<sizeof(T) == 1, std::uint32_t, std::uint64_t>;
  const auto bands = static_cast<std::size_t>(type.bands);
  const std::size_t samples = static_cast<std::size_t>(window.width) * bands;
  constexpr std::int64_t bias = std::is_signed_v<T> ? -static_cast<std::int64_t>(std::numeric_limits<T>::min()) : 0;
  static thread_local std::vector<Sum> sums, squares;
  static thread_local std::vector<T> least, most;
  sums.assign(samples, 0);
  squares.assign(samples, 0);
  const T* first = samples_at<T>(block, type, window.x, window.y);
  least.assign(first, first + samples);
  most = least;
  for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
    const T* row = samples_at<T>(block, type, window.x, y);
    for (std::size_t i = 0; i < samples; ++i) {
      const auto value = static_cast<Sum>(row[i] + bias);
      sums[i] += value;
      squares[i] += value * value;
    }
    for (std::size_t i = 0; i < samples; ++i) {
      least[i] = std::min(least[i], row[i]);
      most[i] = std::max(most[i], row[i]);
    }
  }
  std::vector<BandStatistics> all(static_cast<std::size_t>(type.data_bands()));
  const auto count = static_cast<std::uint64_t>(window.width) * static_cast<std::uint64_t>(window.height);
  for (std::size_t b = 0; b < all.size(); ++b) {
    std::uint64_t sum = 0, square = 0;
    T low = least[b], high = most[b];
    for (std::size_t i = b; i < samples; i += bands) {
      sum += sums[i];
      square += squares[i];
      low = std::min(low, least[i]);
      high = std::max(high, most[i]);
    }
    const auto n = static_cast<long double>(count), s = static_cast<long double>(sum);
    all[b] = {count, static_cast<double>(low), static_cast<double>(high),
              static_cast<double>(s / n - static_cast<long double>(bias)),
              static_cast<double>(std::max(0.0L, static_cast<long double>(square) - s * s / n))};
  }
  return all;
}

/// Anything else: first the mean, then differences from it.
template <class T>
std::vector<BandStatistics> of_valid(const TexelType& type, const Block& block, const Window& window) {
  const Validity<T> validity(type);
  std::vector<BandStatistics> all(static_cast<std::size_t>(type.data_bands()));
  const auto for_each = [&](auto&& take) {
    for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
      const T* texel = samples_at<T>(block, type, window.x, y);
      const std::uint8_t* valid = valid_at(block, window.x, y);
      for (std::int32_t x = 0; x < window.width; ++x, texel += type.bands, valid += valid ? 1 : 0) {
        if (!validity.texel(texel, valid)) continue;
        for (std::size_t b = 0; b < all.size(); ++b)
          if (validity.sample(texel[b])) take(all[b], static_cast<double>(texel[b]));
      }
    }
  };
  for_each([](BandStatistics& band, double value) {
    band.minimum = band.count == 0 ? value : std::min(band.minimum, value);
    band.maximum = band.count == 0 ? value : std::max(band.maximum, value);
    ++band.count;
    // Kept from overflow: a mean of the mean so far, rather than a sum.
    band.mean += value / static_cast<double>(band.count) - band.mean / static_cast<double>(band.count);
  });
  for_each(
      [](BandStatistics& band, double value) { band.sum_of_squares += (value - band.mean) * (value - band.mean); });
  return all;
}

}  // namespace

void BandStatistics::add(const BandStatistics& other) {
  if (other.count == 0) return;
  if (count == 0) {
    *this = other;
    return;
  }
  const double n = static_cast<double>(count), m = static_cast<double>(other.count), difference = other.mean - mean;
  minimum = std::min(minimum, other.minimum);
  maximum = std::max(maximum, other.maximum);
  mean += difference * (m / (n + m));
  sum_of_squares += other.sum_of_squares + difference * difference * (n * m / (n + m));
  count += other.count;
}

std::vector<BandStatistics> statistics(const TexelType& type, const Block& block, const Window& window) {
  return tiff::with_sample(type.sample, [&]<class T>(T) {
    if constexpr (std::is_integral_v<T> && sizeof(T) <= 2)
      if (Validity<T>(type).always()) return of_small_integers<T>(type, block, window);
    return of_valid<T>(type, block, window);
  });
}

bool empty(const TexelType& type, const Block& block, const Window& window) {
  return tiff::with_sample(type.sample, [&]<class T>(T) {
    const Validity<T> validity(type);
    if (validity.always()) return false;
    for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
      const T* texel = samples_at<T>(block, type, window.x, y);
      const std::uint8_t* valid = valid_at(block, window.x, y);
      for (std::int32_t x = 0; x < window.width; ++x, texel += type.bands, valid += valid ? 1 : 0) {
        if (!validity.texel(texel, valid)) continue;
        for (int b = 0; b < type.data_bands(); ++b)
          if (validity.sample(texel[b])) return false;
      }
    }
    return true;
  });
}

}  // namespace nadir::pyramid

#include "statistics.h"

#include <algorithm>

#include "byte_sums.h"
#include "nadir/mosaic/validity.h"

namespace nadir::pyramid {
namespace {

using mosaic::is_whole, mosaic::Validity, mosaic::samples_at, mosaic::valid_at;

/// From whole sums over samples that all count, of values from which `bias` is to be taken.
BandStatistics from_sums(std::uint64_t count, double minimum, double maximum, std::uint64_t sum, std::uint64_t squares,
                         std::int64_t bias) {
  const auto n = static_cast<long double>(count), s = static_cast<long double>(sum);
  return {count, minimum, maximum, static_cast<double>(s / n - static_cast<long double>(bias)),
          static_cast<double>(std::max(0.0L, static_cast<long double>(squares) - s * s / n))};
}

/// Bytes that all count: column by column, which is fast.
std::vector<BandStatistics> of_bytes(const TexelType& type, const Block& block, const Window& window) {
  const auto bands = static_cast<std::size_t>(type.bands);
  const std::size_t samples = static_cast<std::size_t>(window.width) * bands;
  std::vector<std::uint32_t> sums(samples, 0), squares(samples, 0);
  std::vector<std::uint8_t> least(samples, 255), most(samples, 0);
  const ByteColumns columns{sums.data(), squares.data(), least.data(), most.data()};
  const auto row = [&](std::int32_t y) { return samples_at<std::uint8_t>(block, type, window.x, y); };
  std::int32_t y = window.y;
  const std::int32_t end = window.y + window.height;
  for (; y + 4 <= end; y += 4) add_four_rows({row(y), row(y + 1), row(y + 2), row(y + 3)}, samples, columns);
  for (; y < end; ++y) scalar::add_row(row(y), 0, samples, columns);

  std::vector<BandStatistics> all(static_cast<std::size_t>(type.data_bands()));
  const auto count = static_cast<std::uint64_t>(window.width) * static_cast<std::uint64_t>(window.height);
  for (std::size_t b = 0; b < all.size(); ++b) {
    std::uint64_t sum = 0, square = 0;
    std::uint8_t low = 255, high = 0;
    for (std::size_t i = b; i < samples; i += bands) {
      sum += sums[i];
      square += squares[i];
      low = std::min(low, least[i]);
      high = std::max(high, most[i]);
    }
    all[b] = from_sums(count, low, high, sum, square, 0);
  }
  return all;
}

/// 16-bit integers that all count.
template <class T>
std::vector<BandStatistics> of_shorts(const TexelType& type, const Block& block, const Window& window) {
  constexpr std::int32_t bias = -std::int32_t{std::numeric_limits<T>::min()};
  const auto bands = static_cast<std::size_t>(type.bands);
  std::vector<BandStatistics> all(static_cast<std::size_t>(type.data_bands()));
  const auto count = static_cast<std::uint64_t>(window.width) * static_cast<std::uint64_t>(window.height);
  for (std::size_t b = 0; b < all.size(); ++b) {
    std::uint64_t sum = 0, squares = 0;
    T least = std::numeric_limits<T>::max(), most = std::numeric_limits<T>::min();
    for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
      const T* sample = samples_at<T>(block, type, window.x, y) + b;
      for (std::int32_t x = 0; x < window.width; ++x, sample += bands) {
        const auto value = static_cast<std::uint64_t>(*sample + bias);
        sum += value;
        squares += value * value;
        least = std::min(least, *sample);
        most = std::max(most, *sample);
      }
    }
    all[b] = from_sums(count, least, most, sum, squares, bias);
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
    if constexpr (std::is_same_v<T, std::uint8_t>) {
      if (is_whole<T>(type, block, window)) return of_bytes(type, block, window);
    } else if constexpr (std::is_integral_v<T> && sizeof(T) == 2) {
      if (is_whole<T>(type, block, window)) return of_shorts<T>(type, block, window);
    }
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

#include <algorithm>
#include <cmath>
#include <cstring>

#include "axis.h"
#include "duplicate.h"
#include "reduction.h"
#include "whole.h"

namespace nadir::pyramid {
namespace {

using mosaic::samples_at, mosaic::valid_at;

/// Squares of small integers are summed as what they are, others in double.
template <class T>
using SquareSum =
    std::conditional_t<std::is_integral_v<T> && sizeof(T) == 1, std::uint32_t,
                       std::conditional_t<std::is_integral_v<T> && sizeof(T) == 2, std::uint64_t, double>>;
constexpr std::int32_t rows_of_bytes =
    (1 << 16) - 1;  // whose squares, 255^2 at most, fit 32 bits with those of one more

template <class T>
[[gnu::always_inline]] inline SquareSum<T> square(T fine, T coarse) {
  if constexpr (std::is_integral_v<T> && sizeof(T) == 1) {
    const auto d = static_cast<std::int16_t>(fine - coarse);
    return static_cast<std::uint16_t>(d * d);  // 255^2 at most
  } else if constexpr (std::is_integral_v<T> && sizeof(T) == 2) {
    const std::int32_t d = std::int32_t{fine} - coarse;
    const auto size = static_cast<std::uint32_t>(d < 0 ? -d : d);
    return size * size;  // (2^16 - 1)^2 at most
  } else if constexpr (std::is_integral_v<T>) {
    using Bits = std::make_unsigned_t<T>;
    const Bits a = static_cast<Bits>(fine), b = static_cast<Bits>(coarse);
    const double d = static_cast<double>(fine > coarse ? static_cast<Bits>(a - b) : static_cast<Bits>(b - a));
    return d * d;
  } else {
    const double d = static_cast<double>(fine) - static_cast<double>(coarse);
    return d * d;
  }
}

/// Adds squares of differences of one or two rows from another, each column to a sum of its own: the order of additions
/// is that of rows, whatever the kernel.
template <class T>
struct AddSquares {
  [[gnu::always_inline]] static void run(const T* fine, const T* coarse, SquareSum<T>* sums, std::size_t samples) {
    for (std::size_t i = 0; i < samples; ++i) sums[i] += square(fine[i], coarse[i]);
  }
  [[gnu::always_inline]] static void run(const T* fine, const T* next, const T* coarse, SquareSum<T>* __restrict sums,
                                         std::size_t samples) {
    for (std::size_t i = 0; i < samples; ++i)
      sums[i] = sums[i] + square(fine[i], coarse[i]) + square(next[i], coarse[i]);
  }
};

template <class T>
class TileLoss {
 public:
  TileLoss(const TexelType& type, const Axis& x, const Axis& y, const Block& fine, const Window& tile,
           const Block& coarse)
      : type_(type),
        validity_(type),
        y_(y),
        fine_(fine),
        coarse_(coarse),
        tile_(tile),
        bands_(static_cast<std::size_t>(type.bands)),
        columns_(static_cast<std::size_t>(tile.width)),
        samples_(columns_ * bands_),
        twice_(x.halved() && tile.x % 2 == 0 && tile.width % 2 == 0),
        parents_(columns_),
        expanded_(samples_),
        counts_(samples_),
        parent_counts_(samples_),
        sums_(samples_),
        band_sums_(bands_),
        band_counts_(bands_) {
    for (std::int32_t k = 0; k < tile.width; ++k)
      parents_[static_cast<std::size_t>(k)] = static_cast<std::size_t>(x.parent(tile.x + k) - x.parent(tile.x));
    first_parent_ = x.parent(tile.x);
  }

  void run(std::span<float> loss) {
    const std::int32_t end = tile_.y + tile_.height;
    for (std::int32_t y = tile_.y, since_collected = 0, rows = 0; y < end; y += rows) {
      rows = add_rows(y, end);
      since_collected += rows;
      if (since_collected < rows_of_bytes) continue;
      collect();
      since_collected = 0;
    }
    collect();
    for (std::size_t b = 0; b < loss.size(); ++b)
      loss[b] = band_counts_[b] == 0
                    ? 0.0f
                    : static_cast<float>(std::min<long double>(std::sqrt(static_cast<long double>(band_sums_[b]) /
                                                                         static_cast<long double>(band_counts_[b])),
                                                               std::numeric_limits<float>::max()));
  }

 private:
  /// Adds the row `y`, and the one behind it where both have one parent. How many.
  std::int32_t add_rows(std::int32_t y, std::int32_t end) {
    if (y_.parent(y) != parent_row_) expand(y_.parent(y));
    const T* row = samples_at<T>(fine_, type_, tile_.x, y);
    const std::uint8_t* valid = valid_at(fine_, tile_.x, y);
    const auto whole = [&](const T* samples, const std::uint8_t* of_row) {
      return parents_whole_ && is_whole(type_, validity_, samples, of_row, columns_) && all_finite(samples, samples_);
    };
    if (whole(row, valid)) {
      const T* coarse = expanded_.data();
      std::int32_t rows = 1;
      if (y + 1 < end && y_.parent(y + 1) == parent_row_) {
        const T* next = samples_at<T>(fine_, type_, tile_.x, y + 1);
        if (whole(next, valid_at(fine_, tile_.x, y + 1))) rows = 2;
      }
      if (rows == 2)
        pyramid::run<AddSquares<T>>(row, samples_at<T>(fine_, type_, tile_.x, y + 1), coarse, sums_.data(), samples_);
      else
        pyramid::run<AddSquares<T>>(row, coarse, sums_.data(), samples_);
      for (std::uint64_t& count : band_counts_) count += columns_ * static_cast<std::size_t>(rows);
      return rows;
    }
    if (is_void(type_, validity_, row, valid, columns_)) return 1;
    find_valid(validity_, type_, row, valid, columns_, counts_.data());
    for (std::size_t x = 0, i = 0; x < columns_; ++x)
      for (std::size_t b = 0; b < bands_; ++b, ++i) {
        if (!(counts_[i] & parent_counts_[i])) continue;
        sums_[i] += square(row[i], expanded_[i]);
        ++band_counts_[b];
      }
    return 1;
  }

  /// A row of the coarser level, as wide as the tile: each texel's parent.
  void expand(std::int32_t y) {
    parent_row_ = y;
    const std::size_t parents = parents_.back() + 1;
    const T* row = samples_at<T>(coarse_, type_, first_parent_, y);
    const std::uint8_t* valid = valid_at(coarse_, first_parent_, y);
    if (twice_)
      duplicate_texels(reinterpret_cast<const std::byte*>(row), reinterpret_cast<std::byte*>(expanded_.data()),
                       columns_ / 2, bands_ * sizeof(T));
    else
      for (std::size_t x = 0; x < columns_; ++x)
        std::memcpy(expanded_.data() + x * bands_, row + parents_[x] * bands_, bands_ * sizeof(T));
    parents_whole_ = is_whole(type_, validity_, row, valid, parents) && all_finite(row, parents * bands_);
    if (parents_whole_) {
      std::fill(parent_counts_.begin(), parent_counts_.end(), std::uint8_t{1});
      return;
    }
    find_valid(validity_, type_, row, valid, parents, counts_.data());
    for (std::size_t x = 0; x < columns_; ++x)
      std::copy_n(counts_.data() + parents_[x] * bands_, bands_, parent_counts_.data() + x * bands_);
  }

  void collect() {
    for (std::size_t x = 0, i = 0; x < columns_; ++x)
      for (std::size_t b = 0; b < bands_; ++b, ++i) band_sums_[b] += sums_[i];
    std::fill(sums_.begin(), sums_.end(), SquareSum<T>{});
  }

  const TexelType& type_;
  const mosaic::Validity<T> validity_;
  const Axis y_;
  const Block& fine_;
  const Block& coarse_;
  const Window tile_;
  const std::size_t bands_, columns_, samples_;
  const bool twice_;                  // each parent's texel, along a row
  std::vector<std::size_t> parents_;  // of the tile's columns, from the first one's on
  std::int32_t first_parent_ = 0, parent_row_ = -1;
  bool parents_whole_ = false;
  std::vector<T> expanded_;
  std::vector<std::uint8_t> counts_, parent_counts_;
  std::vector<SquareSum<T>> sums_;  // a column and band each
  std::vector<std::conditional_t<std::is_integral_v<T> && sizeof(T) <= 2, std::uint64_t, double>> band_sums_;
  std::vector<std::uint64_t> band_counts_;
};

}  // namespace

void Reducer::loss(const Block& fine, const Window& tile, const Block& coarse, std::span<float> loss) const {
  const Axis x{fine_.width, coarse_.width}, y{fine_.height, coarse_.height};
  tiff::with_sample(type_.sample, [&]<class T>(T) { TileLoss<T>(type_, x, y, fine, tile, coarse).run(loss); });
}

}  // namespace nadir::pyramid

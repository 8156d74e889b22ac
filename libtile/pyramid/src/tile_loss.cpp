#include <algorithm>
#include <cmath>
#include <cstring>

#include "axis.h"
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
constexpr std::int32_t rows_of_bytes = 1 << 16;  // whose squares, 255^2 at most, fit 32 bits together

template <class T>
[[gnu::always_inline]] inline SquareSum<T> square(T fine, T coarse) {
  if constexpr (std::is_integral_v<T> && sizeof(T) == 1) {
    const std::int32_t d = std::int32_t{fine} - coarse;
    return static_cast<std::uint32_t>(d * d);
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

/// Adds squares of differences of two rows, each column to a sum of its own: the order of additions is that of rows,
/// whatever the kernel.
template <class T>
struct AddSquares {
  [[gnu::always_inline]] static void run(const T* fine, const T* coarse, SquareSum<T>* sums, std::size_t samples) {
    for (std::size_t i = 0; i < samples; ++i) sums[i] += square(fine[i], coarse[i]);
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
    for (std::int32_t y = tile_.y; y < tile_.y + tile_.height; ++y) {
      add_row(y);
      if ((y - tile_.y) % rows_of_bytes == rows_of_bytes - 1) collect();
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
  void add_row(std::int32_t y) {
    const T* row = samples_at<T>(fine_, type_, tile_.x, y);
    const std::uint8_t* valid = valid_at(fine_, tile_.x, y);
    if (y_.parent(y) != parent_row_) expand(y_.parent(y));
    if (parents_whole_ && is_whole(type_, validity_, row, valid, columns_) && all_finite(row, samples_)) {
      pyramid::run<AddSquares<T>>(row, static_cast<const T*>(expanded_.data()), sums_.data(), samples_);
      for (std::uint64_t& count : band_counts_) count += columns_;
      return;
    }
    find_valid(validity_, type_, row, valid, columns_, counts_.data());
    for (std::size_t x = 0, i = 0; x < columns_; ++x)
      for (std::size_t b = 0; b < bands_; ++b, ++i) {
        if (!(counts_[i] & parent_counts_[i])) continue;
        sums_[i] += square(row[i], expanded_[i]);
        ++band_counts_[b];
      }
  }

  /// A row of the coarser level, as wide as the tile: each texel's parent.
  void expand(std::int32_t y) {
    parent_row_ = y;
    const std::size_t parents = parents_.back() + 1;
    const T* row = samples_at<T>(coarse_, type_, first_parent_, y);
    const std::uint8_t* valid = valid_at(coarse_, first_parent_, y);
    if (bands_ == 1)
      for (std::size_t x = 0; x < columns_; ++x) expanded_[x] = row[parents_[x]];
    else if (bands_ == 3)
      copy_texels<3>(row);
    else if (bands_ == 4)
      copy_texels<4>(row);
    else
      copy_texels<0>(row);
    parents_whole_ = is_whole(type_, validity_, row, valid, parents) && all_finite(row, parents * bands_);
    if (parents_whole_) {
      std::fill(parent_counts_.begin(), parent_counts_.end(), std::uint8_t{1});
      return;
    }
    find_valid(validity_, type_, row, valid, parents, counts_.data());
    for (std::size_t x = 0; x < columns_; ++x)
      std::copy_n(counts_.data() + parents_[x] * bands_, bands_, parent_counts_.data() + x * bands_);
  }

  template <std::size_t Bands>
  void copy_texels(const T* row) {
    const std::size_t bands = Bands == 0 ? bands_ : Bands;
    for (std::size_t x = 0; x < columns_; ++x)
      std::memcpy(expanded_.data() + x * bands, row + parents_[x] * bands, bands * sizeof(T));
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

// What tiles lose in the next level.
#include <algorithm>
#include <cmath>

#include "byte_sums.h"
#include "nadir/mosaic/validity.h"
#include "parent.h"
#include "reduction.h"

namespace nadir::pyramid {
namespace {

using mosaic::is_whole, mosaic::samples_at, mosaic::valid_at, mosaic::Validity;

/// Rows of a tile beside the texels of the coarser level that stand for them.
template <class T>
class Parents {
 public:
  Parents(const TexelType& type, const Window& tile, LevelSize fine, LevelSize coarse, const Block& block)
      : block_(block), fine_height_(fine.height), coarse_height_(coarse.height) {
    const auto bands = static_cast<std::size_t>(type.bands);
    at_.reserve(static_cast<std::size_t>(tile.width) * bands);
    for (std::int32_t x = 0; x < tile.width; ++x) {
      const std::int32_t p = parent(fine.width, coarse.width, tile.x + x) - block.window().x;
      for (std::size_t b = 0; b < bands; ++b) at_.push_back(static_cast<std::size_t>(p) * bands + b);
    }
    for (Row& row : rows_) row.samples = std::vector<T>(at_.size());
  }

  /// As many samples as the tile's row `y`. Good while the next row is asked for, not longer.
  const T* row(std::int32_t y) {
    const std::int32_t p = parent(fine_height_, coarse_height_, y);
    Row& row = rows_[static_cast<std::size_t>(p) % 2];
    if (row.y != p) {
      row.y = p;
      const T* from = reinterpret_cast<const T*>(block_.row(p));
      for (std::size_t i = 0; i < at_.size(); ++i) row.samples[i] = from[at_[i]];
    }
    return row.samples.data();
  }

 private:
  struct Row {
    std::int32_t y = -1;
    std::vector<T> samples;
  };
  const Block& block_;
  std::int32_t fine_height_, coarse_height_;
  std::vector<std::size_t> at_;
  std::array<Row, 2> rows_;
};

/// Sums of squares by column, all samples counting.
template <class T>
std::vector<double> squares_of_whole(const TexelType& type, const Block& fine, const Window& tile,
                                     Parents<T>& parents) {
  const std::size_t samples = static_cast<std::size_t>(tile.width) * static_cast<std::size_t>(type.bands);
  std::vector<double> squares(samples, 0.0);
  const std::int32_t end = tile.y + tile.height;
  std::int32_t y = tile.y;
  if constexpr (std::is_same_v<T, std::uint8_t>) {
    std::vector<std::uint32_t> bytes(samples, 0);
    for (; y + 2 <= end; y += 2)
      add_squared_differences({samples_at<T>(fine, type, tile.x, y), samples_at<T>(fine, type, tile.x, y + 1)},
                              {parents.row(y), parents.row(y + 1)}, samples, bytes.data());
    std::copy(bytes.begin(), bytes.end(), squares.begin());
  }
  for (; y < end; ++y) {
    const T *row = samples_at<T>(fine, type, tile.x, y), *parent = parents.row(y);
    for (std::size_t i = 0; i < samples; ++i) {
      const double difference = static_cast<double>(row[i]) - static_cast<double>(parent[i]);
      squares[i] += difference * difference;
    }
  }
  return squares;
}

/// As above of what counts; `counts`: how many of each band.
template <class T>
std::vector<double> squares_of_valid(const TexelType& type, const Block& fine, const Window& tile, Parents<T>& parents,
                                     std::vector<std::uint64_t>& counts) {
  const Validity<T> validity(type);
  const auto bands = static_cast<std::size_t>(type.bands);
  const std::size_t samples = static_cast<std::size_t>(tile.width) * bands;
  std::vector<double> squares(samples, 0.0);
  for (std::int32_t y = tile.y; y < tile.y + tile.height; ++y) {
    const T *row = samples_at<T>(fine, type, tile.x, y), *parent = parents.row(y);
    const std::uint8_t* valid = valid_at(fine, tile.x, y);
    for (std::size_t x = 0; x < samples; x += bands, valid += valid ? 1 : 0) {
      if (!validity.texel(row + x, valid)) continue;
      for (std::size_t b = 0; b < counts.size(); ++b) {
        if (!validity.sample(row[x + b]) || !validity.sample(parent[x + b])) continue;
        const double difference = static_cast<double>(row[x + b]) - static_cast<double>(parent[x + b]);
        squares[x + b] += difference * difference;
        ++counts[b];
      }
    }
  }
  return squares;
}

}  // namespace

void Reducer::loss(const Block& fine, const Window& tile, const Block& coarse, std::span<float> loss) const {
  tiff::with_sample(type_.sample, [&]<class T>(T) {
    Parents<T> parents(type_, tile, fine_, coarse_, coarse);
    const auto texels = static_cast<std::uint64_t>(tile.width) * static_cast<std::uint64_t>(tile.height);
    std::vector<std::uint64_t> counts(loss.size(), texels);
    std::vector<double> squares;
    if (is_whole<T>(type_, fine, tile)) {
      squares = squares_of_whole<T>(type_, fine, tile, parents);
    } else {
      std::fill(counts.begin(), counts.end(), std::uint64_t{0});
      squares = squares_of_valid<T>(type_, fine, tile, parents, counts);
    }
    for (std::size_t b = 0; b < loss.size(); ++b) {
      double sum = 0;
      for (std::size_t i = b; i < squares.size(); i += static_cast<std::size_t>(type_.bands)) sum += squares[i];
      loss[b] = counts[b] == 0 ? 0.0f : static_cast<float>(std::sqrt(sum / static_cast<double>(counts[b])));
    }
  });
}

}  // namespace nadir::pyramid

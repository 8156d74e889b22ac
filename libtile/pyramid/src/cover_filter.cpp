#include "cover_filter.h"

#include <cstring>

#include "halve.h"
#include "row_kernels.h"
#include "whole.h"

namespace nadir::pyramid {
namespace {

using mosaic::samples_at, mosaic::valid_at;

/// Texels that are tried together: where a hole keeps the fast way from being taken, it is taken again soon.
constexpr std::int32_t stretch_texels = 128;

/// Rows are reduced a stretch at a time: by a kernel where all that it covers counts in full, at once where nothing
/// does, else texel by texel. All give the same bits.
template <class T>
class CoverFilter {
 public:
  CoverFilter(const LevelPair& pair, const Block& fine, Block& coarse)
      : pair_(pair),
        validity_(pair.type),
        fine_(fine),
        coarse_(coarse),
        texel_(pair, fine),
        bands_(static_cast<std::size_t>(pair.type.bands)),
        fast_(has_kernel()) {}

  void run() {
    const Window& window = coarse_.window();
    for (std::int32_t y = window.y; y < window.y + window.height; ++y)
      for (std::int32_t x = window.x; x < window.x + window.width; x += stretch_texels)
        reduce_stretch(x, y, std::min(stretch_texels, window.x + window.width - x));
  }

 private:
  bool has_kernel() const {
    const bool halved = pair_.x.halved() && pair_.y.halved();
    switch (pair_.reduction.filter) {
      case Filter::Nearest:
        return true;
      case Filter::Mode:
        return halved && std::is_integral_v<T>;
      default:
        return !pair_.reduction.power && (halved || !std::is_integral_v<T> || sizeof(T) < 8);
    }
  }

  void reduce_stretch(std::int32_t x, std::int32_t y, std::int32_t texels) {
    const Window& window = coarse_.window();
    T* out = reinterpret_cast<T*>(coarse_.row(y)) + static_cast<std::size_t>(x - window.x) * bands_;
    std::uint8_t* valid = coarse_.masked() ? coarse_.valid_row(y) + (x - window.x) : nullptr;
    const auto count = static_cast<std::size_t>(texels);
    const Rows from = rows_under(x, y, texels);
    if (fast_ && try_kernel(from, x, y, count, out)) {
      if (valid) std::memset(valid, 255, count);
    } else if (is_void(from)) {
      std::fill_n(out, count * bands_, texel_.of_nothing());
      for (std::size_t k = 0; pair_.type.alpha && k < count; ++k) out[(k + 1) * bands_ - 1] = T{};
      if (valid) std::memset(valid, 0, count);
    } else {
      for (std::int32_t k = 0; k < texels; ++k, out += bands_) {
        const bool held = texel_.reduce(x + k, y, out);
        if (valid) valid[k] = held ? 255 : 0;
      }
    }
  }

  /// What a stretch covers of the finer level.
  struct Rows {
    std::array<const T*, 3> samples = {};
    std::array<const std::uint8_t*, 3> valid = {};
    std::int32_t left = 0;
    std::size_t columns = 0, count = 0;
  };

  Rows rows_under(std::int32_t x, std::int32_t y, std::int32_t texels) const {
    const bool nearest = pair_.reduction.filter == Filter::Nearest;
    const Cover first = pair_.x.cover(x), last = pair_.x.cover(x + texels - 1), down = pair_.y.cover(y);
    Rows rows;
    rows.left = nearest ? 2 * x : first.first;
    const std::int32_t right = nearest ? 2 * (x + texels) - 1 : last.first + last.count;
    rows.columns = static_cast<std::size_t>(right - rows.left);
    rows.count = nearest ? 1 : static_cast<std::size_t>(down.count);
    const std::int32_t top = nearest ? Axis::centre(y) : down.first;
    for (std::size_t k = 0; k < rows.count; ++k) {
      rows.samples[k] = samples_at<T>(fine_, pair_.type, rows.left, top + static_cast<std::int32_t>(k));
      rows.valid[k] = valid_at(fine_, rows.left, top + static_cast<std::int32_t>(k));
    }
    return rows;
  }

  bool is_void(const Rows& rows) const {
    for (std::size_t k = 0; k < rows.count; ++k)
      if (!pyramid::is_void(pair_.type, validity_, rows.samples[k], rows.valid[k], rows.columns)) return false;
    return true;
  }

  /// False where what came out may be wrong: something does not count, or a mean fell onto nodata.
  bool try_kernel(const Rows& rows, std::int32_t x, std::int32_t y, std::size_t texels, T* out) {
    for (std::size_t k = 0; k < rows.count; ++k)
      if (!is_whole(pair_.type, validity_, rows.samples[k], rows.valid[k], rows.columns)) return false;
    const std::size_t samples = texels * bands_;
    if (pair_.reduction.filter == Filter::Nearest) {
      pyramid::run<EverySecond<T>>(rows.samples[0], out, texels, bands_);
      return all_finite(out, samples);
    }
    if constexpr (std::is_integral_v<T>) {
      if (pair_.reduction.filter == Filter::Mode) {
        pyramid::run<ModeOf4<T>>(rows.samples[0], rows.samples[1], out, texels, bands_);
        return true;
      }
    }
    if (pair_.x.halved() && pair_.y.halved()) {
      halve(rows.samples[0], rows.samples[1], out, texels, bands_);
    } else {
      const Cover down = pair_.y.cover(y);
      sums_.resize(rows.columns * bands_);
      pyramid::run<SumRows<T>>(rows.samples.data(), down.parts.data(), down.count, sums_.data(), sums_.size());
      double weight = 0;
      for (int k = 0; k < down.count; ++k) weight += down.parts[static_cast<std::size_t>(k)];
      pyramid::run<MeanOfColumns<T>>(typename MeanOfColumns<T>::Row{pair_.x, x, rows.left, weight},
                                     static_cast<const double*>(sums_.data()), out, texels, bands_);
    }
    if (!all_finite(out, samples)) return false;
    return !validity_.has_nodata() ||
           !pyramid::run<AnyEquals<T>>(static_cast<const T*>(out), samples, validity_.nodata());
  }

  const LevelPair& pair_;
  const mosaic::Validity<T> validity_;
  const Block& fine_;
  Block& coarse_;
  CoveredTexel<T> texel_;
  const std::size_t bands_;
  const bool fast_;
  std::vector<double> sums_;
};

}  // namespace

void reduce_covered(const LevelPair& pair, const Block& fine, Block& coarse) {
  tiff::with_sample(pair.type.sample, [&]<class T>(T) { CoverFilter<T>(pair, fine, coarse).run(); });
}

}  // namespace nadir::pyramid

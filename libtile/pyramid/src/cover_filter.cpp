#include "cover_filter.h"

#include <cstring>

#include "halve.h"
#include "row_kernels.h"

namespace nadir::pyramid {
namespace {

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
    const CoveredRows<T> from(pair_, fine_, x, y, texels);
    if (fast_ && try_kernel(from, x, y, count, out)) {
      if (valid) std::memset(valid, 255, count);
    } else if (from.all_void(pair_.type, validity_)) {
      texel_.fill_with_nothing(out, valid, count);
    } else {
      for (std::int32_t k = 0; k < texels; ++k, out += bands_) {
        const bool held = texel_.reduce(x + k, y, out);
        if (valid) valid[k] = held ? 255 : 0;
      }
    }
  }

  /// False where what came out may be wrong: something does not count, or a mean fell onto nodata.
  bool try_kernel(const CoveredRows<T>& rows, std::int32_t x, std::int32_t y, std::size_t texels, T* out) {
    if (!rows.all_whole(pair_.type, validity_)) return false;
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

#include "held.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nadir/mosaic/validity.h"

namespace nadir::mosaic {
namespace {

/// What a texel with such opacity holds, if its data bands hold all. Opacity of floats has no agreed range: they are
/// always weighted.
template <class T>
Holds holds_under(T alpha) {
  if (std::is_floating_point_v<T>) return alpha > T{} && std::isfinite(alpha) ? Holds::Some : Holds::Nothing;
  return alpha == std::numeric_limits<T>::max() ? Holds::All : alpha > T{} ? Holds::Some : Holds::Nothing;
}

/// Whether all samples hold data and are opaque, which is most often so and can be told fast.
template <class T>
bool holds_all(const TexelType& type, const Block& block, const Validity<T>& validity) {
  const Window& w = block.window();
  const T* samples = reinterpret_cast<const T*>(block.row(w.y));
  const std::size_t count = block.texels() * static_cast<std::size_t>(type.bands);
  if (block.masked()) {
    const std::uint8_t* valid = block.valid_row(w.y);
    if (std::find(valid, valid + block.texels(), 0) != valid + block.texels()) return false;
  }
  if (type.alpha) return false;
  if (validity.has_nodata() && std::find(samples, samples + count, validity.nodata()) != samples + count) return false;
  if constexpr (std::is_floating_point_v<T>) {
    bool finite = true;
    for (std::size_t i = 0; i < count; ++i) finite &= std::abs(samples[i]) <= std::numeric_limits<T>::max();
    return finite;
  }
  return true;
}

template <class T>
void classify(const TexelType& type, const Block& block, const Validity<T>& validity, std::vector<Holds>& texels) {
  const Window& w = block.window();
  const T* texel = reinterpret_cast<const T*>(block.row(w.y));
  const std::uint8_t* valid = block.masked() ? block.valid_row(w.y) : nullptr;
  const int data_bands = type.data_bands();
  texels.resize(block.texels());
  for (std::size_t i = 0; i < texels.size(); ++i, texel += type.bands) {
    int bands = 0;
    for (int band = 0; band < data_bands; ++band) bands += validity.sample(texel[band]);
    Holds holds = bands == data_bands ? Holds::All : bands > 0 ? Holds::Some : Holds::Nothing;
    if (valid && !valid[i]) holds = Holds::Nothing;
    if (type.alpha) holds = std::min(holds, holds_under(texel[data_bands]));
    texels[i] = holds;
  }
}

}  // namespace

void Held::read(const TexelType& type, const Block& block) {
  tiff::with_sample(type.sample, [&](auto sample) {
    using T = decltype(sample);
    const Validity<T> validity(type);
    all_ = holds_all(type, block, validity);
    if (all_) return;
    classify(type, block, validity, texels_);
    all_ = std::all_of(texels_.begin(), texels_.end(), [](Holds h) { return h == Holds::All; });
  });
}

}  // namespace nadir::mosaic

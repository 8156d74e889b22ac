#include "validity.h"

#include <algorithm>
#include <cmath>
#include <limits>

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
bool holds_all(const TexelType& type, const Block& block, const DataSample<T>& is_data) {
  const Window& w = block.window();
  const T* samples = reinterpret_cast<const T*>(block.row(w.y));
  const std::size_t count = block.texels() * static_cast<std::size_t>(type.bands);
  if (block.masked()) {
    const std::uint8_t* valid = block.valid_row(w.y);
    if (std::find(valid, valid + block.texels(), 0) != valid + block.texels()) return false;
  }
  if (type.alpha) return false;
  if (is_data.has_nodata() && std::find(samples, samples + count, is_data.nodata()) != samples + count) return false;
  if constexpr (std::is_floating_point_v<T>) {
    bool finite = true;
    for (std::size_t i = 0; i < count; ++i) finite &= std::abs(samples[i]) <= std::numeric_limits<T>::max();
    return finite;
  }
  return true;
}

template <class T>
void classify(const TexelType& type, const Block& block, const DataSample<T>& is_data, std::vector<Holds>& texels) {
  const Window& w = block.window();
  const T* texel = reinterpret_cast<const T*>(block.row(w.y));
  const std::uint8_t* valid = block.masked() ? block.valid_row(w.y) : nullptr;
  const int data_bands = type.data_bands();
  texels.resize(block.texels());
  for (std::size_t i = 0; i < texels.size(); ++i, texel += type.bands) {
    int bands = 0;
    for (int band = 0; band < data_bands; ++band) bands += is_data(texel[band]);
    Holds holds = bands == data_bands ? Holds::All : bands > 0 ? Holds::Some : Holds::Nothing;
    if (valid && !valid[i]) holds = Holds::Nothing;
    if (type.alpha) holds = std::min(holds, holds_under(texel[data_bands]));
    texels[i] = holds;
  }
}

}  // namespace

template <class T>
DataSample<T>::DataSample(const TexelType& type) {
  if (!type.nodata) return;
  // A value that no sample can have marks none; NaN and infinities mark none but those that hold no data anyway.
  const double value = *type.nodata;
  if constexpr (std::is_floating_point_v<T>) {
    has_nodata_ = std::abs(value) <= std::numeric_limits<T>::max();
  } else {
    const double beyond = std::ldexp(1.0, std::numeric_limits<T>::digits);  // one above the greatest
    const double lowest = static_cast<double>(std::numeric_limits<T>::lowest());
    has_nodata_ = value >= lowest && value < beyond && value == std::floor(value);
  }
  if (has_nodata_) nodata_ = static_cast<T>(value);
}

template <class T>
bool DataSample<T>::operator()(T sample) const {
  if constexpr (std::is_floating_point_v<T>)
    if (!std::isfinite(sample)) return false;
  return !has_nodata_ || sample != nodata_;
}

void Validity::read(const TexelType& type, const Block& block) {
  tiff::with_sample(type.sample, [&](auto sample) {
    using T = decltype(sample);
    const DataSample<T> is_data(type);
    all_ = holds_all(type, block, is_data);
    if (all_) return;
    classify(type, block, is_data, texels_);
    all_ = std::all_of(texels_.begin(), texels_.end(), [](Holds h) { return h == Holds::All; });
  });
}

template class DataSample<std::uint8_t>;
template class DataSample<std::int8_t>;
template class DataSample<std::uint16_t>;
template class DataSample<std::int16_t>;
template class DataSample<std::uint32_t>;
template class DataSample<std::int32_t>;
template class DataSample<std::uint64_t>;
template class DataSample<std::int64_t>;
template class DataSample<float>;
template class DataSample<double>;

}  // namespace nadir::mosaic

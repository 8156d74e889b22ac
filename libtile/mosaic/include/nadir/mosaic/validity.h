#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "nadir/mosaic/block.h"

namespace nadir::mosaic {

/// What of a texel of type T counts.
template <class T>
class Validity {
 public:
  explicit Validity(const TexelType& type)
      : bands_(type.bands), data_bands_(type.data_bands()), mask_(type.mask), alpha_(type.alpha) {
    if (!type.nodata || std::isnan(*type.nodata)) return;
    // A value that the type cannot hold is no sample's.
    const double value = *type.nodata;
    if constexpr (std::is_integral_v<T>) {
      const bool held = value >= static_cast<double>(std::numeric_limits<T>::lowest()) &&
                        value <= static_cast<double>(std::numeric_limits<T>::max()) && value == std::floor(value);
      if (!held) return;
      // The greatest 64-bit integers round up to a double beyond them.
      nodata_ = value >= 0x1p63 && sizeof(T) == 8 && value >= static_cast<double>(std::numeric_limits<T>::max())
                    ? std::numeric_limits<T>::max()
                    : static_cast<T>(value);
    } else {
      nodata_ = static_cast<T>(value);
    }
    has_nodata_ = true;
  }

  bool has_nodata() const { return has_nodata_; }
  T nodata() const { return nodata_; }

  /// Whether every sample of every texel is valid, whatever it is: there is nothing to ask.
  bool always() const { return !mask_ && !alpha_ && !has_nodata_ && std::is_integral_v<T>; }

  static constexpr T opaque() { return std::is_integral_v<T> ? std::numeric_limits<T>::max() : T{1}; }

  /// Whether a data sample counts, its texel being valid.
  bool sample(T value) const {
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(value)) return false;
    return !has_nodata_ || value != nodata_;
  }

  /// Whether a texel may count: not masked, not wholly transparent. `valid`: its byte where there is a mask.
  bool texel(const T* samples, const std::uint8_t* valid) const {
    if (mask_ && *valid == 0) return false;
    return !alpha_ || samples[data_bands_] > T{};
  }

  /// Whether all samples of a texel count, in full.
  bool whole(const T* samples, const std::uint8_t* valid) const {
    if (mask_ && *valid == 0) return false;
    if (alpha_ && samples[data_bands_] != opaque()) return false;
    for (int b = 0; b < data_bands_; ++b)
      if (!sample(samples[b])) return false;
    return true;
  }

 private:
  int bands_, data_bands_;
  bool mask_, alpha_, has_nodata_ = false;
  T nodata_{};
};

/// Whole numbers of 64 bits need more than a double to be averaged exactly.
template <class T>
using Mean = std::conditional_t<std::is_integral_v<T> && sizeof(T) == 8, long double, double>;

/// The sample nearest to a mean, halves up, within the type and never nodata.
template <class T>
T to_sample(Mean<T> mean, const Validity<T>& validity) {
  T sample;
  if constexpr (std::is_integral_v<T>) {
    const Mean<T> rounded = std::floor(mean + Mean<T>(0.5));
    if (rounded <= static_cast<Mean<T>>(std::numeric_limits<T>::lowest()))
      sample = std::numeric_limits<T>::lowest();
    else if (rounded >= static_cast<Mean<T>>(std::numeric_limits<T>::max()))
      sample = std::numeric_limits<T>::max();
    else
      sample = static_cast<T>(rounded);
  } else {
    const Mean<T> most = static_cast<Mean<T>>(std::numeric_limits<T>::max());
    sample = static_cast<T>(std::clamp(mean, -most, most));
  }
  if (!validity.has_nodata() || sample != validity.nodata()) return sample;
  // A hole would be wrong by more than one step.
  if constexpr (std::is_integral_v<T>) {
    const bool down = mean < static_cast<Mean<T>>(sample) ? sample > std::numeric_limits<T>::lowest()
                                                          : sample == std::numeric_limits<T>::max();
    return static_cast<T>(down ? sample - 1 : sample + 1);
  } else {
    return std::nextafter(sample, mean < sample ? std::numeric_limits<T>::lowest() : std::numeric_limits<T>::max());
  }
}

/// A row of a block from column `x` on.
template <class T>
const T* samples_at(const Block& block, const TexelType& type, std::int32_t x, std::int32_t y) {
  return reinterpret_cast<const T*>(block.row(y)) +
         static_cast<std::size_t>(x - block.window().x) * static_cast<std::size_t>(type.bands);
}
inline const std::uint8_t* valid_at(const Block& block, std::int32_t x, std::int32_t y) {
  return block.masked() ? block.valid_row(y) + (x - block.window().x) : nullptr;
}

/// Whether all samples of a window count in full.
template <class T>
bool is_whole(const TexelType& type, const Block& block, const Window& window) {
  const Validity<T> validity(type);
  if (validity.always()) return true;
  for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
    const T* texel = samples_at<T>(block, type, window.x, y);
    const std::uint8_t* valid = valid_at(block, window.x, y);
    for (std::int32_t x = 0; x < window.width; ++x, texel += type.bands, valid += valid ? 1 : 0)
      if (!validity.whole(texel, valid)) return false;
  }
  return true;
}

}  // namespace nadir::mosaic

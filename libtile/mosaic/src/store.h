#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "nadir/mosaic/placement.h"
#include "nadir/mosaic/validity.h"

namespace nadir::mosaic {

/// The T nearest to `value`, halves up, within its range.
template <class T, class A>
T nearest_sample(A value) {
  if constexpr (std::is_floating_point_v<T>) {
    constexpr A greatest = std::numeric_limits<T>::max();
    return static_cast<T>(std::clamp<A>(value, -greatest, greatest));
  } else if constexpr (sizeof(T) < sizeof(A)) {
    using Integer = std::conditional_t<sizeof(A) == 4, std::int32_t, std::int64_t>;
    const A held = std::clamp<A>(value, std::numeric_limits<T>::lowest(), std::numeric_limits<T>::max()) + A(0.5);
    const Integer towards_zero = static_cast<Integer>(held);
    return static_cast<T>(towards_zero - (std::is_signed_v<T> && static_cast<A>(towards_zero) > held));
  } else {
    const A rounded = std::floor(value + A(0.5));
    if (rounded >= std::ldexp(A(1), std::numeric_limits<T>::digits)) return std::numeric_limits<T>::max();
    return static_cast<T>(std::max<A>(rounded, static_cast<A>(std::numeric_limits<T>::lowest())));
  }
}

/// Samples of a band out of what was calculated.
template <class T, class A>
class Store {
 public:
  Store(const TexelType& type, const PlacementOptions& options, bool power)
      : type_(type), validity_(type), power_(power), scale_(options.scale), offset_(options.offset) {}

  /// Of `texels` whole texels.
  void all(const A* values, int texels, T* to) const {
    if (!power_ && !validity_.has_nodata()) {
      for (int i = 0; i < texels * type_.bands; ++i) to[i] = nearest_sample<T>(values[i]);
      return;
    }
    for (int i = 0; i < texels; ++i, values += type_.bands, to += type_.bands) {
      for (int band = 0; band < type_.data_bands(); ++band) to[band] = data(values[band]);
      if (type_.alpha) to[type_.data_bands()] = nearest_sample<T>(values[type_.data_bands()]);
    }
  }

  /// Never nodata: what would be becomes the next on the side of `value`.
  T data(A value) const {
    if (power_) value = stored_decibels(value);
    const T sample = nearest_sample<T>(value);
    return validity_.has_nodata() && sample == validity_.nodata() ? to_sample<T>(value, validity_) : sample;
  }

  /// What a band holds that holds nothing in a texel where another does.
  T hole() const {
    if (validity_.has_nodata()) return validity_.nodata();
    return std::is_floating_point_v<T> ? std::numeric_limits<T>::quiet_NaN() : T{};
  }

 private:
  A stored_decibels(A power) const {
    const double decibels = 10 * std::log10(std::max<double>(static_cast<double>(power), least_power));
    return static_cast<A>((decibels - offset_) / scale_);
  }

  static constexpr double least_power = 1e-300;  // -3000 dB: nothing measured is as faint, and its logarithm is finite

  const TexelType& type_;
  const Validity<T> validity_;
  const bool power_;
  const double scale_, offset_;
};

}  // namespace nadir::mosaic

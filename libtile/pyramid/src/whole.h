#pragma once

#include <cstdint>
#include <type_traits>

#include "nadir/mosaic/validity.h"
#include "statistics.h"
#include "vector.h"

namespace nadir::pyramid {

/// Whether one of `count` samples equals `value`.
template <class T>
struct AnyEquals {
  [[gnu::always_inline]] static bool run(const T* samples, std::size_t count, T value) {
    unsigned found = 0;
    for (std::size_t i = 0; i < count; ++i) found |= samples[i] == value ? 1u : 0u;
    return found != 0;
  }
};

/// Whether one of `count` samples, each `step` after the one before, differs from `value`.
template <class T>
struct AnyDiffers {
  template <std::size_t Step>
  [[gnu::always_inline]] static bool run_step(const T* samples, std::size_t count, T value) {
    unsigned found = 0;
    for (std::size_t i = 0; i < count; ++i) found |= samples[i * Step] != value ? 1u : 0u;
    return found != 0;
  }
  [[gnu::always_inline]] static bool run(const T* samples, std::size_t count, std::size_t step, T value) {
    if (step == 1) return run_step<1>(samples, count, value);
    if (step == 2) return run_step<2>(samples, count, value);
    if (step == 4) return run_step<4>(samples, count, value);
    for (std::size_t i = 0; i < count; ++i)
      if (samples[i * step] != value) return true;
    return false;
  }
};

template <class T>
struct AnyFinite {
  [[gnu::always_inline]] static bool run(const T* samples, std::size_t count) {
    unsigned found = 0;
    for (std::size_t i = 0; i < count; ++i) found |= samples[i] - samples[i] == T{} ? 1u : 0u;
    return found != 0;
  }
};

template <class T>
struct AnyNotFinite {
  [[gnu::always_inline]] static bool run(const T* samples, std::size_t count) {
    unsigned found = 0;
    // A number less itself is 0; NaN and infinity less themselves are NaN.
    for (std::size_t i = 0; i < count; ++i) found |= samples[i] - samples[i] == T{} ? 0u : 1u;
    return found != 0;
  }
};

/// Whether all samples of `texels` texels of a row count in full, as far as that needs no look at single texels; floats
/// may still be no numbers.
template <class T>
bool is_whole(const TexelType& type, const mosaic::Validity<T>& validity, const T* samples, const std::uint8_t* valid,
              std::size_t texels) {
  const auto bands = static_cast<std::size_t>(type.bands);
  if (type.mask && run<AnyEquals<std::uint8_t>>(valid, texels, std::uint8_t{0})) return false;
  if (type.alpha && run<AnyDiffers<T>>(samples + bands - 1, texels, bands, mosaic::Validity<T>::opaque())) return false;
  return !validity.has_nodata() || !run<AnyEquals<T>>(samples, texels * bands, validity.nodata());
}

/// Whether `texels` texels of a row are all masked, all transparent or all nodata.
template <class T>
bool is_hidden(const TexelType& type, const mosaic::Validity<T>& validity, const T* samples, const std::uint8_t* valid,
               std::size_t texels) {
  const auto bands = static_cast<std::size_t>(type.bands);
  if (type.mask && !run<AnyDiffers<std::uint8_t>>(valid, texels, std::size_t{1}, std::uint8_t{0})) return true;
  if (type.alpha) return !run<AnyDiffers<T>>(samples + bands - 1, texels, bands, T{});
  return validity.has_nodata() && !run<AnyDiffers<T>>(samples, texels * bands, std::size_t{1}, validity.nodata());
}

/// Whether no sample of `texels` texels of a row counts, as far as that needs no look at single texels.
template <class T>
bool is_void(const TexelType& type, const mosaic::Validity<T>& validity, const T* samples, const std::uint8_t* valid,
             std::size_t texels) {
  if (is_hidden(type, validity, samples, valid, texels)) return true;
  if constexpr (std::is_floating_point_v<T>)
    return !run<AnyFinite<T>>(samples, texels * static_cast<std::size_t>(type.bands));
  else
    return false;
}

/// Which samples of a row's data bands count: 1 or 0 each; 0 for alpha.
template <class T>
void find_valid(const mosaic::Validity<T>& validity, const TexelType& type, const T* samples, const std::uint8_t* valid,
                std::size_t texels, std::uint8_t* counts) {
  const auto bands = static_cast<std::size_t>(type.bands), data_bands = static_cast<std::size_t>(type.data_bands());
  for (std::size_t x = 0; x < texels; ++x, samples += bands, counts += bands) {
    const bool texel = validity.texel(samples, valid ? valid + x : nullptr);
    for (std::size_t b = 0; b < bands; ++b) counts[b] = texel && b < data_bands && validity.sample(samples[b]) ? 1 : 0;
  }
}

template <class T>
bool all_finite(const T* samples, std::size_t count) {
  if constexpr (std::is_floating_point_v<T>)
    return !run<AnyNotFinite<T>>(samples, count);
  else
    return true;
}

}  // namespace nadir::pyramid

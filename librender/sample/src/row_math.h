#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "kernels.h"

namespace nadir::render {

// Loops that compilers make vectors of: always inline, so that each set of kernels has them for its instructions.

/// Parameter of Keys' cubic convolution. Source: Keys, Cubic Convolution Interpolation for Digital Image Processing,
/// 1981, equation 15: the one whose error is of third order.
inline constexpr float cubic_a = -0.5f;

/// Of a row of places, the weights of the four texels around each, `f` of the way from the second to the third.
struct CubicWeights {
  [[gnu::always_inline]] CubicWeights(const float* fractions, int count) {
    for (int i = 0; i < count; ++i) {
      const float f = fractions[i], g = 1 - f;
      w[0][i] = cubic_a * f * g * g;
      w[1][i] = ((cubic_a + 2) * f - (cubic_a + 3)) * f * f + 1;
      w[2][i] = ((cubic_a + 2) * g - (cubic_a + 3)) * g * g + 1;
      w[3][i] = cubic_a * g * f * f;
    }
  }
  alignas(64) float w[4][row_px];
};

[[gnu::always_inline]] inline float lerp(float a, float b, float f) { return a + (b - a) * f; }

/// As pmulhrsw does.
[[gnu::always_inline]] inline std::int16_t lerp_fixed(std::int16_t a, std::int16_t b, std::int16_t f) {
  return static_cast<std::int16_t>(a + (((b - a) * f + (1 << (fraction_bits - 1))) >> fraction_bits));
}

[[gnu::always_inline]] inline void blend_values(const float* coarse, const float* shares, int count, float* values) {
  for (int i = 0; i < count; ++i) values[i] = lerp(values[i], coarse[i], shares[i]);
}

template <class Value, class Sum>
[[gnu::always_inline]] inline void add_values(const Value* values, int count, Sum* sums) {
  for (int i = 0; i < count; ++i) sums[i] += values[i];
}

template <class T>
[[gnu::always_inline]] inline void round_values(const float* values, int count, float scale, T* out) {
  for (int i = 0; i < count; ++i) {
    const float value = values[i] * scale;
    if constexpr (std::is_floating_point_v<T>) {
      out[i] = value;
    } else {
      constexpr float low = std::numeric_limits<T>::min(), high = std::numeric_limits<T>::max();
      const float held = std::min(std::max(value, low), high);
      out[i] = static_cast<T>(static_cast<std::int32_t>(held - low + 0.5f) + static_cast<std::int32_t>(low));
    }
  }
}

[[gnu::always_inline]] inline void round_fixed_values(const std::int16_t* values, int count, std::uint8_t* out) {
  for (int i = 0; i < count; ++i) out[i] = static_cast<std::uint8_t>((values[i] + fixed_one / 2) >> fixed_one_log2);
}

[[gnu::always_inline]] inline void round_fixed_sums(const std::int32_t* sums, int count, float scale,
                                                    std::uint8_t* out) {
  for (int i = 0; i < count; ++i)
    out[i] = static_cast<std::uint8_t>(static_cast<std::int32_t>(static_cast<float>(sums[i]) * scale + 0.5f));
}

}  // namespace nadir::render

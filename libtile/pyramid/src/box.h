#pragma once

#include <cstddef>
#include <cstdint>

namespace nadir::pyramid {

/// Means of 2 x 2 texels of two rows, halves up: `texels` of them, of `bands` interleaved samples.
/// Exact. All kernels give the same bits.
void average_2x2(const std::uint8_t* top, const std::uint8_t* bottom, std::uint8_t* out, std::size_t texels,
                 std::size_t bands);

namespace scalar {
template <class T>
void average_2x2(const T* top, const T* bottom, T* out, std::size_t texels, std::size_t bands) {
  for (std::size_t x = 0; x < texels; ++x, top += 2 * bands, bottom += 2 * bands, out += bands)
    for (std::size_t b = 0; b < bands; ++b)
      out[b] = static_cast<T>((std::int32_t{top[b]} + top[bands + b] + bottom[b] + bottom[bands + b] + 2) >> 2);
}
}  // namespace scalar

}  // namespace nadir::pyramid

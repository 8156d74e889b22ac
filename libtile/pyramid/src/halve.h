#pragma once

#include <cstddef>
#include <cstdint>

namespace nadir::pyramid {

/// Means of 2x2 texels of two rows of 2 `texels`, all valid. Bands are interleaved.
/// Integers: exact, then to nearest, ties up. Floats: ((a + c) + (b + d)) / 4 in double, for a, b above c, d; not
/// finite where one of them is not, or in double where their sum is not. Defined for all of tiff::Sample. All kernels
/// return the same bits.
template <class T>
void halve(const T* top, const T* bottom, T* out, std::size_t texels, std::size_t bands);

namespace scalar {
template <class T>
void halve(const T* top, const T* bottom, T* out, std::size_t texels, std::size_t bands);
}

}  // namespace nadir::pyramid

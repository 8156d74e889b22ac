#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace nadir::mosaic {

/// Texels that are calculated together: enough to spread the cost of a row's ends, and their places stay in registers'
/// reach.
constexpr int run_texels = 64;

/// Places in the source of a run of texels: the sample up and left of each, and how far right of and below it they lie.
template <class A>
struct Places {
  std::array<std::ptrdiff_t, run_texels> sample;
  std::array<A, run_texels> right, below;  // [0, 1)
};

/// Between `a` and `b`: exactly `a` where both are the same.
template <class A>
A between(A a, A b, A share) {
  return a + share * (b - a);
}

/// Bilinear interpolation of band `b` at a place whose four texels start at these samples.
template <class S, class A>
A bilinear(const S* upper_left, const S* upper_right, const S* lower_left, const S* lower_right, A right, A below) {
  const A upper = between(static_cast<A>(*upper_left), static_cast<A>(*upper_right), right);
  const A lower = between(static_cast<A>(*lower_left), static_cast<A>(*lower_right), right);
  return between(upper, lower, below);
}

/// The definition: bilinear samples of `count` places, all bands, set into or added to `sums`.
/// `Bands`: as many as `bands`, or 0 where that is known only here. `row`: samples from one row to the next.
template <int Bands, bool Add, class S, class A>
void bilinear_run(const S* samples, std::ptrdiff_t row, int bands, const Places<A>& places, int count, A* sums) {
  const int n = Bands ? Bands : bands;
  for (int i = 0; i < count; ++i) {
    const S* upper = samples + places.sample[static_cast<std::size_t>(i)];
    const S* lower = upper + row;
    const A right = places.right[static_cast<std::size_t>(i)], below = places.below[static_cast<std::size_t>(i)];
    for (int b = 0; b < n; ++b, ++upper, ++lower, ++sums) {
      const A value = bilinear(upper, upper + n, lower, lower + n, right, below);
      *sums = Add ? *sums + value : value;
    }
  }
}

/// Four floats that are calculated with at once, in the same steps as one.
using Float4 = float __attribute__((vector_size(16)));

/// The four bytes of a texel, each times the power of two that its place in the word makes of it: exact, and with
/// `byte_scale` at the end the bits of a calculation without.
template <int Bands>
Float4 scaled_bytes(std::uint32_t texel) {
  using Word4 = std::uint32_t __attribute__((vector_size(16)));
  using Int4 = std::int32_t __attribute__((vector_size(16)));
  static_assert(std::endian::native == std::endian::little);
  // The fourth byte moves down, out of the sign.
  const Word4 words = {texel, texel, texel, Bands == 4 ? texel >> 8 : texel};
  const Word4 mask = {0xff, 0xff00, 0xff0000, Bands == 4 ? 0xff0000u : 0u};
  return __builtin_convertvector(std::bit_cast<Int4>(words & mask), Float4);
}
inline constexpr Float4 byte_scale = {1, 0x1p-8f, 0x1p-16f, 0x1p-16f};

/// The bits of bilinear_run for three or four bands of bytes. `sums` has room for one more than 3 * count.
template <int Bands, bool Add>
void bilinear_run_bytes(const std::uint8_t* samples, std::ptrdiff_t row, const Places<float>& places, int count,
                        float* sums) {
  static_assert(Bands == 3 || Bands == 4);
  const auto two_texels = [](const std::uint8_t* texel, Float4& first, Float4& second) {
    std::uint32_t a, b;  // no byte beyond the two: the second word starts early, and loses what it has too many
    std::memcpy(&a, texel, 4);
    std::memcpy(&b, texel + 2 * Bands - 4, 4);
    first = scaled_bytes<Bands>(a);
    second = scaled_bytes<Bands>(Bands == 3 ? b >> 8 : b);
  };
  for (int i = 0; i < count; ++i, sums += Bands) {
    const std::uint8_t* texel = samples + places.sample[static_cast<std::size_t>(i)];
    const float right = places.right[static_cast<std::size_t>(i)], below = places.below[static_cast<std::size_t>(i)];
    Float4 a, b, c, d;
    two_texels(texel, a, b);
    two_texels(texel + row, c, d);
    const Float4 upper = a + right * (b - a), lower = c + right * (d - c);
    Float4 value = (upper + below * (lower - upper)) * byte_scale;
    if constexpr (Add) {
      Float4 before;
      std::memcpy(&before, sums, sizeof before);
      value = before + value;
    }
    if constexpr (Add && Bands == 3) {
      // The fourth is the next texel's first sum.
      sums[0] = value[0], sums[1] = value[1], sums[2] = value[2];
    } else {
      std::memcpy(sums, &value, sizeof value);
    }
  }
}

/// Weights of four samples about a place `share` beyond the second: Catmull and Rom's spline, that is, cubic
/// convolution with a = -1/2. Source: Keys, Cubic convolution interpolation for digital image processing, 1981,
/// equation 15.
template <class A>
std::array<A, 4> cubic_weights(A share) {
  const A s = share, t = 1 - share, half = A(0.5);
  const A first = -half * s * t * t, last = -half * t * s * s;
  const A second = 1 - s * s * (A(2.5) - A(1.5) * s);
  return {first, second, 1 - first - second - last, last};
}

}  // namespace nadir::mosaic

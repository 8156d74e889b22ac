#include "halve.h"

#include <type_traits>

#include "vector.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace nadir::pyramid {
namespace {

template <class T>
[[gnu::always_inline]] inline T mean_of_4(T a, T b, T c, T d) {
  if constexpr (std::is_floating_point_v<T>) {
    const double sum = (double{a} + double{c}) + (double{b} + double{d});
    return static_cast<T>(sum * 0.25 + 0.0);  // one zero, not two
  } else {
    using Sum =
        std::conditional_t<sizeof(T) <= 2, std::int32_t, std::conditional_t<sizeof(T) == 4, std::int64_t, __int128>>;
    return static_cast<T>((Sum{a} + b + c + d + 2) >> 2);
  }
}

template <class T>
struct Halve {
  template <std::size_t Bands>
  [[gnu::always_inline]] static void run_bands(const T* top, const T* bottom, T* out, std::size_t texels) {
    for (std::size_t i = 0; i < texels; ++i)
      for (std::size_t b = 0; b < Bands; ++b) {
        const std::size_t at = 2 * i * Bands + b;
        out[i * Bands + b] = mean_of_4(top[at], top[at + Bands], bottom[at], bottom[at + Bands]);
      }
  }

  [[gnu::always_inline]] static void run(const T* top, const T* bottom, T* out, std::size_t texels, std::size_t bands) {
    if (bands == 1) return run_bands<1>(top, bottom, out, texels);
    if (bands == 3) return run_bands<3>(top, bottom, out, texels);
    if (bands == 4) return run_bands<4>(top, bottom, out, texels);
    for (std::size_t i = 0; i < texels; ++i, top += 2 * bands, bottom += 2 * bands, out += bands)
      for (std::size_t b = 0; b < bands; ++b) out[b] = mean_of_4(top[b], top[bands + b], bottom[b], bottom[bands + b]);
  }
};

#if defined(__x86_64__)
/// Bytes of a vector of 16 that are whole pairs of texels.
template <class T>
constexpr std::size_t lane_bytes(std::size_t bands) {
  return 16 / (2 * bands * sizeof(T)) * (2 * bands * sizeof(T));
}

/// Puts samples of a band in the two texels of each pair side by side.
template <class T>
void pair_up(char* order, std::size_t bands) {
  for (std::size_t i = 0; i < 16; ++i) order[i] = -1;
  for (std::size_t i = 0; i < lane_bytes<T>(bands); ++i) {
    const std::size_t byte = i % sizeof(T), sample = i / sizeof(T), second = sample % 2, band = sample / 2 % bands;
    const std::size_t pair = sample / (2 * bands);
    order[i] = static_cast<char>(((2 * pair + second) * bands + band) * sizeof(T) + byte);
  }
}

/// Two lanes of two rows, each 16 bytes with pairs of texels at its start, to means: 16-bit ones of bytes, 32-bit ones
/// of 16 bits.
template <class T>
[[gnu::target("avx2"), gnu::always_inline]] inline __m256i means_of_lanes(const std::byte* top, const std::byte* bottom,
                                                                          std::size_t lane, __m256i order) {
  const auto load = [&](const std::byte* from) __attribute__((target("avx2"), always_inline)) {
    const __m128i low = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from));
    const __m128i high = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from + lane));
    return _mm256_shuffle_epi8(_mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1), order);
  };
  const __m256i a = load(top), b = load(bottom);
  if constexpr (sizeof(T) == 1) {
    const __m256i one = _mm256_set1_epi8(1);
    const __m256i sum = _mm256_add_epi16(_mm256_maddubs_epi16(a, one), _mm256_maddubs_epi16(b, one));
    return _mm256_srli_epi16(_mm256_add_epi16(sum, _mm256_set1_epi16(2)), 2);
  } else {
    const __m256i first = _mm256_set1_epi32(0xffff);
    const __m256i sum = _mm256_add_epi32(_mm256_add_epi32(_mm256_and_si256(a, first), _mm256_srli_epi32(a, 16)),
                                         _mm256_add_epi32(_mm256_and_si256(b, first), _mm256_srli_epi32(b, 16)));
    return _mm256_srli_epi32(_mm256_add_epi32(sum, _mm256_set1_epi32(2)), 2);
  }
}

/// Four lanes at a time, for 1 to 4 bands of unsigned samples; returns how many texels of the result are done.
template <class T>
[[gnu::target("avx2")]] std::size_t halve_avx2(const T* top, const T* bottom, T* out, std::size_t texels,
                                               std::size_t bands) {
  alignas(16) char order_of_pairs[16];
  pair_up<T>(order_of_pairs, bands);
  const __m256i order = _mm256_broadcastsi128_si256(_mm_load_si128(reinterpret_cast<const __m128i*>(order_of_pairs)));
  // A lane of 12 bytes gives 6, and 2 that mean nothing.
  const __m256i close_up =
      _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 1, 2, 3, 4, 5, 8, 9, 10, 11, 12, 13, -1, -1, -1, -1));
  const std::size_t lane = lane_bytes<T>(bands), step = 2 * lane / (bands * sizeof(T));  // texels of the result
  const auto* a = reinterpret_cast<const std::byte*>(top);
  const auto* b = reinterpret_cast<const std::byte*>(bottom);
  auto* to = reinterpret_cast<std::byte*>(out);
  // Lanes of 12 bytes are read and written with 4 bytes of what follows: that much must be there.
  const std::size_t beyond = lane == 16 ? 0 : step;
  std::size_t i = 0;
  for (; i + step + beyond <= texels; i += step, a += 4 * lane, b += 4 * lane, to += 2 * lane) {
    const __m256i low = means_of_lanes<T>(a, b, lane, order);
    const __m256i high = means_of_lanes<T>(a + 2 * lane, b + 2 * lane, lane, order);
    __m256i packed = sizeof(T) == 1 ? _mm256_packus_epi16(low, high) : _mm256_packus_epi32(low, high);
    packed = _mm256_permute4x64_epi64(packed, 0xd8);
    if (lane == 16) {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), packed);
    } else {
      packed = _mm256_shuffle_epi8(packed, close_up);
      _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm256_castsi256_si128(packed));
      _mm_storeu_si128(reinterpret_cast<__m128i*>(to + lane), _mm256_extracti128_si256(packed, 1));
    }
  }
  return i;
}
#endif

}  // namespace

template <class T>
void scalar::halve(const T* top, const T* bottom, T* out, std::size_t texels, std::size_t bands) {
  Halve<T>::run(top, bottom, out, texels, bands);
}

template <class T>
void halve(const T* top, const T* bottom, T* out, std::size_t texels, std::size_t bands) {
#if defined(__x86_64__)
  if constexpr (std::is_same_v<T, std::uint8_t> || std::is_same_v<T, std::uint16_t>) {
    if (has_avx2() && bands <= 4) {
      const std::size_t done = halve_avx2(top, bottom, out, texels, bands);
      const std::size_t fine = 2 * done * bands;
      return scalar::halve(top + fine, bottom + fine, out + done * bands, texels - done, bands);
    }
  }
#endif
  run<Halve<T>>(top, bottom, out, texels, bands);
}

#define NADIR_HALVE(T)                                                      \
  template void halve<T>(const T*, const T*, T*, std::size_t, std::size_t); \
  template void scalar::halve<T>(const T*, const T*, T*, std::size_t, std::size_t);
NADIR_HALVE(std::uint8_t)
NADIR_HALVE(std::int8_t)
NADIR_HALVE(std::uint16_t)
NADIR_HALVE(std::int16_t)
NADIR_HALVE(std::uint32_t)
NADIR_HALVE(std::int32_t)
NADIR_HALVE(std::uint64_t)
NADIR_HALVE(std::int64_t)
NADIR_HALVE(float)
NADIR_HALVE(double)
#undef NADIR_HALVE

}  // namespace nadir::pyramid

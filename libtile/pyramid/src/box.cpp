#include "box.h"

#if defined(__x86_64__)
#include <emmintrin.h>
#endif

namespace nadir::pyramid {
namespace {

#if defined(__x86_64__)
/// Sums of 8 columns of bytes, from `at` on.
__m128i columns(const std::uint8_t* top, const std::uint8_t* bottom, std::size_t at) {
  const auto wide = [&](const std::uint8_t* row) {
    return _mm_unpacklo_epi8(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(row + at)), _mm_setzero_si128());
  };
  return _mm_add_epi16(wide(top), wide(bottom));
}

__m128i quarter(__m128i sums) { return _mm_srli_epi16(_mm_add_epi16(sums, _mm_set1_epi16(2)), 2); }

/// Two texels of three bands make one: the upper half of six sums is moved onto the lower.
std::size_t average_triples(const std::uint8_t* top, const std::uint8_t* bottom, std::uint8_t* out,
                            std::size_t texels) {
  const __m128i three = _mm_setr_epi16(-1, -1, -1, 0, 0, 0, 0, 0);
  const auto pair = [&](std::size_t at) {
    const __m128i sums = columns(top, bottom, at);
    return _mm_and_si128(_mm_add_epi16(sums, _mm_srli_si128(sums, 6)), three);
  };
  std::size_t x = 0;
  // Four texels at a time; the last load and the last store reach two bytes and four bytes further.
  for (; x + 6 <= texels; x += 4) {
    const std::size_t at = 6 * x;
    const __m128i low = _mm_or_si128(pair(at), _mm_slli_si128(pair(at + 6), 6));
    const __m128i high = _mm_or_si128(pair(at + 12), _mm_slli_si128(pair(at + 18), 6));
    // 6 of 8 sums each: bytes 0 to 5 and 8 to 13
    const __m128i bytes = _mm_packus_epi16(quarter(low), quarter(high));
    _mm_storel_epi64(reinterpret_cast<__m128i*>(out + 3 * x), bytes);
    _mm_storel_epi64(reinterpret_cast<__m128i*>(out + 3 * x + 6), _mm_srli_si128(bytes, 8));
  }
  return x;
}

std::size_t average_quads(const std::uint8_t* top, const std::uint8_t* bottom, std::uint8_t* out, std::size_t texels) {
  std::size_t x = 0;
  for (; x + 4 <= texels; x += 4) {
    const auto pair = [&](std::size_t at) {
      const __m128i sums = columns(top, bottom, at);
      return _mm_add_epi16(sums, _mm_srli_si128(sums, 8));
    };
    const std::size_t at = 8 * x;
    const __m128i low = _mm_unpacklo_epi64(pair(at), pair(at + 8));
    const __m128i high = _mm_unpacklo_epi64(pair(at + 16), pair(at + 24));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out + 4 * x), _mm_packus_epi16(quarter(low), quarter(high)));
  }
  return x;
}

std::size_t average_singles(const std::uint8_t* top, const std::uint8_t* bottom, std::uint8_t* out,
                            std::size_t texels) {
  const __m128i even = _mm_set1_epi16(0x00ff);
  const auto pairs = [&](std::size_t at) {
    const auto row = [&](const std::uint8_t* bytes) {
      const __m128i b = _mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes + at));
      return _mm_add_epi16(_mm_and_si128(b, even), _mm_srli_epi16(b, 8));
    };
    return quarter(_mm_add_epi16(row(top), row(bottom)));
  };
  std::size_t x = 0;
  for (; x + 16 <= texels; x += 16)
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out + x), _mm_packus_epi16(pairs(2 * x), pairs(2 * x + 16)));
  return x;
}
#endif

}  // namespace

void average_2x2(const std::uint8_t* top, const std::uint8_t* bottom, std::uint8_t* out, std::size_t texels,
                 std::size_t bands) {
  std::size_t done = 0;
#if defined(__x86_64__)
  if (bands == 1) done = average_singles(top, bottom, out, texels);
  if (bands == 3) done = average_triples(top, bottom, out, texels);
  if (bands == 4) done = average_quads(top, bottom, out, texels);
#endif
  scalar::average_2x2(top + 2 * bands * done, bottom + 2 * bands * done, out + bands * done, texels - done, bands);
}

}  // namespace nadir::pyramid

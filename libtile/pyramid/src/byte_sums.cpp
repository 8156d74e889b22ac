#include "byte_sums.h"

#include <algorithm>

#if defined(__x86_64__)
#include <emmintrin.h>
#endif

namespace nadir::pyramid {
namespace {

#if defined(__x86_64__)
__m128i load(const void* at) { return _mm_loadu_si128(static_cast<const __m128i*>(at)); }
void store(void* at, __m128i value) { _mm_storeu_si128(static_cast<__m128i*>(at), value); }
void add_to(std::uint32_t* at, __m128i value) { store(at, _mm_add_epi32(load(at), value)); }

/// Adds a^2 + b^2 of eight pairs of 16-bit numbers.
void add_squares(__m128i a, __m128i b, std::uint32_t* squares) {
  const __m128i low = _mm_unpacklo_epi16(a, b), high = _mm_unpackhi_epi16(a, b);
  add_to(squares, _mm_madd_epi16(low, low));
  add_to(squares + 4, _mm_madd_epi16(high, high));
}

std::size_t add_four_rows_sse2(const std::array<const std::uint8_t*, 4>& rows, std::size_t count,
                               const ByteColumns& columns) {
  const __m128i zero = _mm_setzero_si128();
  std::size_t i = 0;
  for (; i + 16 <= count; i += 16) {
    const __m128i a = load(rows[0] + i), b = load(rows[1] + i), c = load(rows[2] + i), d = load(rows[3] + i);
    store(columns.least + i,
          _mm_min_epu8(load(columns.least + i), _mm_min_epu8(_mm_min_epu8(a, b), _mm_min_epu8(c, d))));
    store(columns.most + i, _mm_max_epu8(load(columns.most + i), _mm_max_epu8(_mm_max_epu8(a, b), _mm_max_epu8(c, d))));
    const auto half = [&](std::size_t at, __m128i e, __m128i f, __m128i g, __m128i h) {
      const __m128i sum = _mm_add_epi16(_mm_add_epi16(e, f), _mm_add_epi16(g, h));
      add_to(columns.sums + at, _mm_unpacklo_epi16(sum, zero));
      add_to(columns.sums + at + 4, _mm_unpackhi_epi16(sum, zero));
      const __m128i ef = _mm_unpacklo_epi16(e, f), gh = _mm_unpacklo_epi16(g, h);
      add_to(columns.squares + at, _mm_add_epi32(_mm_madd_epi16(ef, ef), _mm_madd_epi16(gh, gh)));
      const __m128i ef_high = _mm_unpackhi_epi16(e, f), gh_high = _mm_unpackhi_epi16(g, h);
      add_to(columns.squares + at + 4,
             _mm_add_epi32(_mm_madd_epi16(ef_high, ef_high), _mm_madd_epi16(gh_high, gh_high)));
    };
    half(i, _mm_unpacklo_epi8(a, zero), _mm_unpacklo_epi8(b, zero), _mm_unpacklo_epi8(c, zero),
         _mm_unpacklo_epi8(d, zero));
    half(i + 8, _mm_unpackhi_epi8(a, zero), _mm_unpackhi_epi8(b, zero), _mm_unpackhi_epi8(c, zero),
         _mm_unpackhi_epi8(d, zero));
  }
  return i;
}

std::size_t add_squared_differences_sse2(const std::array<const std::uint8_t*, 2>& a,
                                         const std::array<const std::uint8_t*, 2>& p, std::size_t count,
                                         std::uint32_t* squares) {
  const __m128i zero = _mm_setzero_si128();
  std::size_t i = 0;
  for (; i + 16 <= count; i += 16) {
    const __m128i a0 = load(a[0] + i), p0 = load(p[0] + i), a1 = load(a[1] + i), p1 = load(p[1] + i);
    const auto low = [&](__m128i x, __m128i y) {
      return _mm_sub_epi16(_mm_unpacklo_epi8(x, zero), _mm_unpacklo_epi8(y, zero));
    };
    const auto high = [&](__m128i x, __m128i y) {
      return _mm_sub_epi16(_mm_unpackhi_epi8(x, zero), _mm_unpackhi_epi8(y, zero));
    };
    add_squares(low(a0, p0), low(a1, p1), squares + i);
    add_squares(high(a0, p0), high(a1, p1), squares + i + 8);
  }
  return i;
}
#endif

}  // namespace

void scalar::add_row(const std::uint8_t* row, std::size_t begin, std::size_t end, const ByteColumns& columns) {
  for (std::size_t i = begin; i < end; ++i) {
    const std::uint32_t value = row[i];
    columns.sums[i] += value;
    columns.squares[i] += value * value;
    columns.least[i] = std::min(columns.least[i], row[i]);
    columns.most[i] = std::max(columns.most[i], row[i]);
  }
}

void scalar::add_squared_differences(const std::uint8_t* a, const std::uint8_t* p, std::size_t begin, std::size_t end,
                                     std::uint32_t* squares) {
  for (std::size_t i = begin; i < end; ++i) {
    const int difference = a[i] - p[i];
    squares[i] += static_cast<std::uint32_t>(difference * difference);
  }
}

void add_four_rows(const std::array<const std::uint8_t*, 4>& rows, std::size_t count, const ByteColumns& columns) {
  std::size_t done = 0;
#if defined(__x86_64__)
  done = add_four_rows_sse2(rows, count, columns);
#endif
  for (const std::uint8_t* row : rows) scalar::add_row(row, done, count, columns);
}

void add_squared_differences(const std::array<const std::uint8_t*, 2>& a, const std::array<const std::uint8_t*, 2>& p,
                             std::size_t count, std::uint32_t* squares) {
  std::size_t done = 0;
#if defined(__x86_64__)
  done = add_squared_differences_sse2(a, p, count, squares);
#endif
  for (std::size_t i = 0; i < 2; ++i) scalar::add_squared_differences(a[i], p[i], done, count, squares);
}

}  // namespace nadir::pyramid

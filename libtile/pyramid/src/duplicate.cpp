#include "duplicate.h"

#include <cstring>

#include "vector.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace nadir::pyramid {
namespace {

#if defined(__x86_64__)
/// Texels of at most 8 bytes: as many at a time as fit 16 bytes twice. Returns how many texels are done.
[[gnu::target("avx2")]] std::size_t duplicate_avx2(const std::byte* row, std::byte* out, std::size_t texels,
                                                   std::size_t texel_bytes) {
  constexpr std::size_t vector_bytes = 16;
  const std::size_t step = vector_bytes / (2 * texel_bytes);
  alignas(vector_bytes) char order_of_bytes[vector_bytes];
  for (std::size_t i = 0; i < vector_bytes; ++i)
    order_of_bytes[i] = static_cast<char>(i / (2 * texel_bytes) * texel_bytes + i % texel_bytes);
  const __m128i order = _mm_load_si128(reinterpret_cast<const __m128i*>(order_of_bytes));
  // Each time a whole vector is read and written: that much of the row must be there, and what is written beyond the
  // texels that are meant is written again.
  std::size_t i = 0;
  for (; (texels - i) * texel_bytes >= vector_bytes; i += step) {
    const __m128i from = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + i * texel_bytes));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out + 2 * i * texel_bytes), _mm_shuffle_epi8(from, order));
  }
  return i;
}
#endif

}  // namespace

void scalar::duplicate_texels(const std::byte* row, std::byte* out, std::size_t texels, std::size_t texel_bytes) {
  for (std::size_t i = 0; i < texels; ++i, row += texel_bytes)
    for (int copy = 0; copy < 2; ++copy, out += texel_bytes) std::memcpy(out, row, texel_bytes);
}

void duplicate_texels(const std::byte* row, std::byte* out, std::size_t texels, std::size_t texel_bytes) {
  std::size_t done = 0;
#if defined(__x86_64__)
  if (has_avx2() && texel_bytes <= 8) done = duplicate_avx2(row, out, texels, texel_bytes);
#endif
  scalar::duplicate_texels(row + done * texel_bytes, out + 2 * done * texel_bytes, texels - done, texel_bytes);
}

}  // namespace nadir::pyramid

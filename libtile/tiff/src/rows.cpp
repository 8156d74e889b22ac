#include "rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace nadir::tiff {
namespace {

bool file_order_is_foreign(const TileFormat& format) {
  // Codecs of pictures give native samples.
  const bool picture = format.codec == Codec::Jpeg || format.codec == Codec::WebP || format.codec == Codec::Lerc;
  return !picture && format.big_endian != (std::endian::native == std::endian::big);
}

template <class T>
void swap_bytes(T* samples, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if constexpr (sizeof(T) == 2) samples[i] = __builtin_bswap16(samples[i]);
    if constexpr (sizeof(T) == 4) samples[i] = __builtin_bswap32(samples[i]);
    if constexpr (sizeof(T) == 8) samples[i] = __builtin_bswap64(samples[i]);
  }
}

template <class T>
void accumulate(T* samples, std::size_t count, std::size_t step) {
  for (std::size_t i = step; i < count; ++i) samples[i] = static_cast<T>(samples[i] + samples[i - step]);
}

/// Floats were split into planes of bytes, highest first, and those summed: put them back together, native.
void join_byte_planes(std::byte* row, std::byte* scratch, std::size_t count, std::size_t width, std::size_t step) {
  accumulate_bytes(reinterpret_cast<std::uint8_t*>(row), count * width, step);
  std::memcpy(scratch, row, count * width);
  for (std::size_t b = 0; b < width; ++b) {
    const std::byte* plane = scratch + b * count;
    std::byte* to = row + (std::endian::native == std::endian::big ? b : width - 1 - b);
    for (std::size_t i = 0; i < count; ++i) to[i * width] = plane[i];
  }
}

/// What `accumulate` turns back.
template <class T>
void take_differences(const T* samples, std::size_t count, std::size_t step, T* out) {
  std::memcpy(out, samples, std::min(step, count) * sizeof(T));
  for (std::size_t i = step; i < count; ++i) out[i] = static_cast<T>(samples[i] - samples[i - step]);
}

/// What `join_byte_planes` turns back.
template <class T>
void split_byte_planes(const T* samples, std::size_t count, std::size_t step, std::uint8_t* out) {
  static thread_local std::vector<std::uint8_t> planes;
  planes.resize(count * sizeof(T));
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t b = 0; b < sizeof(T); ++b)
      planes[b * count + i] = static_cast<std::uint8_t>(samples[i] >> (8 * (sizeof(T) - 1 - b)));
  take_differences(planes.data(), planes.size(), step, out);
}

/// One byte a sample, 0 or not, to bits, high ones first.
void pack_bits(const std::byte* row, std::size_t count, std::byte* out) {
  for (std::size_t i = 0; i < count; i += 8) {
    unsigned byte = 0;
    for (std::size_t bit = 0; bit < 8 && i + bit < count; ++bit)
      byte |= (row[i + bit] != std::byte{0} ? 0x80u : 0u) >> bit;
    out[i / 8] = static_cast<std::byte>(byte);
  }
}

/// IEEE 754 binary16.
float float_from_16(std::uint32_t bits) {
  const std::uint32_t sign = (bits & 0x8000u) << 16, exponent = (bits >> 10) & 31, fraction = bits & 1023;
  if (exponent == 0)
    return std::bit_cast<float>(sign | std::bit_cast<std::uint32_t>(static_cast<float>(fraction) * 0x1p-24f));
  const std::uint32_t wide = exponent == 31 ? 255u : exponent + 112;
  return std::bit_cast<float>(sign | (wide << 23) | (fraction << 13));
}

/// Adobe's 24 bits: 1 sign, 7 exponent, 16 fraction.
float float_from_24(std::uint32_t bits) {
  const std::uint32_t sign = (bits & 0x800000u) << 8, exponent = (bits >> 16) & 127, fraction = bits & 0xffff;
  if (exponent == 0)
    return std::bit_cast<float>(sign | std::bit_cast<std::uint32_t>(static_cast<float>(fraction) * 0x1p-78f));
  const std::uint32_t wide = exponent == 127 ? 255u : exponent + 64;
  return std::bit_cast<float>(sign | (wide << 23) | (fraction << 7));
}

/// `width` whole bytes, in the order they lie.
std::uint32_t whole_bytes(const std::byte* at, std::size_t width, bool high_first) {
  std::uint32_t value = 0;
  for (std::size_t b = 0; b < width; ++b)
    value |= static_cast<std::uint32_t>(at[b]) << (8 * (high_first ? width - 1 - b : b));
  return value;
}

/// Samples of any number of bits up to 32, high bits first whatever the order of bytes.
template <class T>
void unpack_bits(const std::byte* row, std::size_t count, std::uint32_t bits, T* out) {
  std::uint64_t window = 0;
  std::uint32_t held = 0;
  for (std::size_t i = 0; i < count; ++i) {
    while (held < bits) {
      window = (window << 8) | static_cast<std::uint64_t>(*row++);
      held += 8;
    }
    held -= bits;
    out[i] = static_cast<T>((window >> held) & ((std::uint64_t{1} << bits) - 1));
  }
}

#if defined(__x86_64__)
/// Five texels of three bytes at a time.
[[gnu::target("ssse3")]] void accumulate_triples_ssse3(std::uint8_t* row, std::size_t bytes) {
  const __m128i last = _mm_setr_epi8(12, 13, 14, 12, 13, 14, 12, 13, 14, 12, 13, 14, 12, 13, 14, -1);
  __m128i carry = _mm_setzero_si128();
  std::size_t i = 0;
  if (bytes >= 32) {
    // Read ahead of the store before it: a load that overlaps a fresh store waits for it.
    __m128i raw = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row));
    for (; i + 31 <= bytes; i += 15) {
      const __m128i next = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + i + 15));
      __m128i sum = _mm_add_epi8(raw, _mm_slli_si128(raw, 3));
      sum = _mm_add_epi8(sum, _mm_slli_si128(sum, 6));
      sum = _mm_add_epi8(sum, _mm_slli_si128(sum, 12));
      sum = _mm_add_epi8(sum, carry);
      carry = _mm_shuffle_epi8(sum, last);
      _mm_storeu_si128(reinterpret_cast<__m128i*>(row + i), sum);  // and a sixteenth byte, which the next store rights
      raw = next;
    }
    row[i] = static_cast<std::uint8_t>(_mm_cvtsi128_si32(raw));
  }
  for (i = i < 3 ? 3 : i; i < bytes; ++i) row[i] = static_cast<std::uint8_t>(row[i] + row[i - 3]);
}

/// Sixteen bytes at a time; `Step` divides them.
template <int Step>
[[gnu::target("ssse3")]] void accumulate_ssse3(std::uint8_t* row, std::size_t bytes) {
  alignas(16) static constexpr char last_of[3][16] = {{15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15, 15},
                                                      {14, 15, 14, 15, 14, 15, 14, 15, 14, 15, 14, 15, 14, 15, 14, 15},
                                                      {12, 13, 14, 15, 12, 13, 14, 15, 12, 13, 14, 15, 12, 13, 14, 15}};
  const __m128i last = _mm_load_si128(reinterpret_cast<const __m128i*>(last_of[Step == 1 ? 0 : Step == 2 ? 1 : 2]));
  __m128i carry = _mm_setzero_si128();
  std::size_t i = 0;
  for (; i + 16 <= bytes; i += 16) {
    __m128i sum = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + i));
    if constexpr (Step == 1) sum = _mm_add_epi8(sum, _mm_slli_si128(sum, 1));
    if constexpr (Step <= 2) sum = _mm_add_epi8(sum, _mm_slli_si128(sum, 2));
    sum = _mm_add_epi8(sum, _mm_slli_si128(sum, 4));
    sum = _mm_add_epi8(sum, _mm_slli_si128(sum, 8));
    sum = _mm_add_epi8(sum, carry);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(row + i), sum);
    carry = _mm_shuffle_epi8(sum, last);
  }
  for (i = i < Step ? Step : i; i < bytes; ++i) row[i] = static_cast<std::uint8_t>(row[i] + row[i - Step]);
}
#endif

}  // namespace

void scalar::accumulate_bytes(std::uint8_t* row, std::size_t bytes, std::size_t step) {
  for (std::size_t i = step; i < bytes; ++i) row[i] = static_cast<std::uint8_t>(row[i] + row[i - step]);
}

void accumulate_bytes(std::uint8_t* row, std::size_t bytes, std::size_t step) {
#if defined(__x86_64__)
  static const bool ssse3 = __builtin_cpu_supports("ssse3");
  if (ssse3 && step == 3) return accumulate_triples_ssse3(row, bytes);
  if (ssse3 && step == 1) return accumulate_ssse3<1>(row, bytes);
  if (ssse3 && step == 2) return accumulate_ssse3<2>(row, bytes);
  if (ssse3 && step == 4) return accumulate_ssse3<4>(row, bytes);
#endif
  scalar::accumulate_bytes(row, bytes, step);
}

bool rows_are_plain(const TileFormat& format) {
  return format.predictor == Predictor::None && wide_row_bytes(format) == 0 &&
         !(format.bits > 8 && file_order_is_foreign(format));
}

std::size_t wide_row_bytes(const TileFormat& format) {
  const bool as_stored = format.bits == 8 || format.bits == 16 || format.bits == 32 || format.bits == 64;
  if (as_stored && !(format.number == Number::Float && format.bits == 16)) return 0;
  return std::size_t{format.tile_width} * format.samples_together() * size_bytes(decoded_sample(format));
}

void predict_row(const TileFormat& format, const std::byte* row, std::byte* packed) {
  const std::size_t step = format.samples_together(), count = std::size_t{format.tile_width} * step;
  const bool horizontal = format.predictor == Predictor::Horizontal;
  const bool planes = format.predictor == Predictor::FloatingPoint;
  const auto differences = [&]<class T>(T) {
    const auto* samples = reinterpret_cast<const T*>(row);
    if (planes)
      split_byte_planes(samples, count, step, reinterpret_cast<std::uint8_t*>(packed));
    else
      take_differences(samples, count, step, reinterpret_cast<T*>(packed));
  };
  if (format.bits == 1)
    pack_bits(row, count, packed);
  else if (!horizontal && !planes)
    std::memcpy(packed, row, static_cast<std::size_t>(format.row_bytes()));
  else if (format.bits == 8)
    differences(std::uint8_t{});
  else if (format.bits == 16)
    differences(std::uint16_t{});
  else if (format.bits == 32)
    differences(std::uint32_t{});
  else
    differences(std::uint64_t{});
}

const std::byte* restore_row(const TileFormat& format, std::byte* row, std::byte* scratch, std::byte* wide) {
  const std::size_t step = format.samples_together(), count = std::size_t{format.tile_width} * step;
  const std::size_t width = format.bits / 8;
  bool foreign = file_order_is_foreign(format);
  if (format.predictor == Predictor::FloatingPoint) {
    join_byte_planes(row, scratch, count, width, step);
    foreign = false;
  }
  const bool horizontal = format.predictor == Predictor::Horizontal;
  switch (format.bits) {
    case 8:
      if (horizontal) accumulate_bytes(reinterpret_cast<std::uint8_t*>(row), count, step);
      break;
    case 16:
      if (foreign) swap_bytes(reinterpret_cast<std::uint16_t*>(row), count);
      if (horizontal) accumulate(reinterpret_cast<std::uint16_t*>(row), count, step);
      break;
    case 32:
      if (foreign) swap_bytes(reinterpret_cast<std::uint32_t*>(row), count);
      if (horizontal) accumulate(reinterpret_cast<std::uint32_t*>(row), count, step);
      break;
    case 64:
      if (foreign) swap_bytes(reinterpret_cast<std::uint64_t*>(row), count);
      if (horizontal) accumulate(reinterpret_cast<std::uint64_t*>(row), count, step);
      break;
    default:
      break;
  }
  if (wide_row_bytes(format) == 0) return row;
  if (format.number == Number::Float) {
    auto* out = reinterpret_cast<float*>(wide);
    if (format.bits == 16)
      for (std::size_t i = 0; i < count; ++i) out[i] = float_from_16(reinterpret_cast<const std::uint16_t*>(row)[i]);
    else
      for (std::size_t i = 0; i < count; ++i)
        out[i] = float_from_24(whole_bytes(row + 3 * i, 3, foreign != (std::endian::native == std::endian::big)));
    return wide;
  }
  with_sample(decoded_sample(format), [&]<class T>(T) {
    if (format.bits == 24)  // as GDAL writes them: its bits run high to low, and libtiff turns whole samples around
      for (std::size_t i = 0; i < count; ++i)
        reinterpret_cast<T*>(wide)[i] = static_cast<T>(whole_bytes(row + 3 * i, 3, !format.big_endian));
    else
      unpack_bits(row, count, format.bits, reinterpret_cast<T*>(wide));
  });
  return wide;
}

}  // namespace nadir::tiff

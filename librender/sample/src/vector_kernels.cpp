// Compiled once for each instruction set. Scalable vectors are left to the sets of fixed size that go with them: pieces
// of 16 bytes are what a pixel is made of.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "vector_kernels.cpp"

#include <cstring>
#include <limits>

#include "kernels.h"
#include "row_math.h"
#include "vector_kernels.h"

// In this order: what follows is compiled again and again
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "vector_places-inl.h"

HWY_BEFORE_NAMESPACE();
namespace nadir::render {
namespace HWY_NAMESPACE {
#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
const Kernels* table() { return &scalar_kernels(); }
#else
namespace {

template <class V>
HWY_INLINE V mix_fixed(V a, V b, V f) {
  return hn::Add(a, hn::MulFixedPoint15(hn::Sub(b, a), f));
}
template <class V>
HWY_INLINE V mix_float(V a, V b, V f) {
  return hn::Add(a, hn::Mul(hn::Sub(b, a), f));
}

// ---- bytes, four channels: a pixel's four texels are 16 bytes

/// For each of 8 pixels, the bytes of its 16-bit word in a vector of 8, as often as it takes to fill a piece.
struct WordOfPixel {
  constexpr WordOfPixel() {
    for (int k = 0; k < 4; ++k)
      for (int i = 0; i < 16; ++i) {
        const auto byte = static_cast<std::uint8_t>(i & 1);
        even[16 * k + i] = static_cast<std::uint8_t>(2 * (2 * k) + byte);
        odd[16 * k + i] = static_cast<std::uint8_t>(2 * (2 * k + 1) + byte);
        both[16 * k + i] = i < 8 ? even[16 * k + i] : odd[16 * k + i];
      }
  }
  alignas(64) std::uint8_t even[64] = {}, odd[64] = {}, both[64] = {};
};
constexpr WordOfPixel word_of_pixel;

constexpr std::size_t pieces = (HWY_MAX_BYTES >= 64 ? 64 : HWY_MAX_BYTES >= 32 ? 32 : 16) / 16;  // of 16 bytes
using Bytes = hn::FixedTag<std::uint8_t, 16 * pieces>;

/// The texels left, right of one pixel: above in the lower half, below in the upper.
HWY_INLINE hn::Vec<hn::FixedTag<std::uint8_t, 16> > four_texels(const std::uint8_t* top, std::size_t pitch) {
  const hn::FixedTag<std::uint8_t, 8> half;
  return hn::Combine(hn::FixedTag<std::uint8_t, 16>(), hn::LoadU(half, top + pitch), hn::LoadU(half, top));
}

/// Of every second pixel.
HWY_INLINE hn::Vec<Bytes> texels_of(const std::uint8_t* patch, std::size_t pitch, const std::int32_t* at) {
  const auto piece = [&](int i) {
    return four_texels(patch + 4 * static_cast<std::size_t>(static_cast<std::uint32_t>(at[2 * i])), pitch);
  };
#if HWY_MAX_BYTES >= 64
  const hn::FixedTag<std::uint8_t, 32> d32;
  return hn::Combine(Bytes(), hn::Combine(d32, piece(3), piece(2)), hn::Combine(d32, piece(1), piece(0)));
#elif HWY_MAX_BYTES >= 32
  return hn::Combine(Bytes(), piece(1), piece(0));
#else
  return piece(0);
#endif
}

void bilinear4_bytes(const std::uint8_t* patch, std::int32_t pitch, const Places& places, int count,
                     std::int16_t* out) {
  const Bytes d8;
  const hn::Repartition<std::int16_t, Bytes> d16;
  const hn::Repartition<std::uint64_t, Bytes> d64;
  const std::size_t pitch_bytes = 4 * static_cast<std::size_t>(pitch);
  const auto word = [&](auto words, auto table) {
    return hn::BitCast(d16, hn::TableLookupBytes(hn::BitCast(d8, words), table));
  };
  const auto down = [&](auto texels, auto f) {
    const auto zero = hn::Zero(d8);
    const auto top = hn::BitCast(d16, hn::InterleaveLower(d8, texels, zero)),
               bottom = hn::BitCast(d16, hn::InterleaveUpper(d8, texels, zero));
    return mix_fixed(hn::ShiftLeft<fixed_one_log2>(top), hn::ShiftLeft<fixed_one_log2>(bottom), f);
  };
  for (int i = 0; i < count; i += 8) {
    const auto x = hn::LoadDup128(d16, places.x15 + i), y = hn::LoadDup128(d16, places.y15 + i);
    for (std::size_t k = 0; k < 4; k += pieces) {
      const std::int32_t* at = places.at + i + 2 * k;
      const auto table = [&](const std::uint8_t* of_pixels) { return hn::Load(d8, of_pixels + 16 * k); };
      const auto a = hn::BitCast(d64, down(texels_of(patch, pitch_bytes, at), word(y, table(word_of_pixel.even))));
      const auto b = hn::BitCast(d64, down(texels_of(patch, pitch_bytes, at + 1), word(y, table(word_of_pixel.odd))));
      const auto left = hn::BitCast(d16, hn::InterleaveLower(d64, a, b)),
                 right = hn::BitCast(d16, hn::InterleaveUpper(d64, a, b));
      hn::StoreU(mix_fixed(left, right, word(x, table(word_of_pixel.both))), d16,
                 out + 4 * (i + 2 * static_cast<int>(k)));
    }
  }
}

// ---- one channel: lanes are pixels, whose texels are copied together first, left and right

template <class T>
struct Staged {
  Staged(const T* patch, std::int32_t pitch, const Places& places, int count) {
    for (int i = 0; i < count; ++i) {
      const T* from = patch + places.at[i];
      std::memcpy(top + 2 * i, from, 2 * sizeof(T));
      std::memcpy(bottom + 2 * i, from + pitch, 2 * sizeof(T));
    }
  }
  alignas(64) T top[2 * row_px], bottom[2 * row_px];
};

void bilinear1_bytes(const std::uint8_t* patch, std::int32_t pitch, const Places& places, int count,
                     std::int16_t* out) {
  const Staged<std::uint8_t> staged(patch, pitch, places, count);
  const hn::CappedTag<std::int16_t, row_px> d;
  const hn::Repartition<std::uint16_t, decltype(d)> du;
  const hn::Repartition<std::uint8_t, decltype(d)> d8;
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    // The byte to the left is the lower one of a word
    const auto top = hn::BitCast(du, hn::Load(d8, staged.top + 2 * i)),
               bottom = hn::BitCast(du, hn::Load(d8, staged.bottom + 2 * i));
    const auto left = [&](auto words) {
      return hn::BitCast(d, hn::ShiftLeft<fixed_one_log2>(hn::And(words, hn::Set(du, 0xff))));
    };
    const auto right = [&](auto words) {
      return hn::BitCast(d, hn::ShiftLeft<fixed_one_log2>(hn::ShiftRight<8>(words)));
    };
    const auto y = hn::Load(d, places.y15 + i), x = hn::Load(d, places.x15 + i);
    hn::StoreU(mix_fixed(mix_fixed(left(top), left(bottom), y), mix_fixed(right(top), right(bottom), y), x), d,
               out + i);
  }
}

// ---- other types, and cubic: in float

template <class D, class T>
HWY_INLINE hn::Vec<D> load_float(D d, const T* from) {
  if constexpr (std::is_same_v<T, float>) {
    return hn::LoadU(d, from);
  } else {
    const hn::Rebind<std::int32_t, D> di;
    return hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(hn::Rebind<T, D>(), from)));
  }
}

template <class T>
void bilinear4(const T* patch, std::int32_t pitch, const Places& places, int count, float* out) {
  const hn::FixedTag<float, 4> d;
  for (int i = 0; i < count; ++i) {
    const T* top = patch + 4 * static_cast<std::ptrdiff_t>(places.at[i]);
    const T* bottom = top + 4 * static_cast<std::ptrdiff_t>(pitch);
#if HWY_MAX_BYTES >= 32
    const hn::FixedTag<float, 8> both;
    const auto down = mix_float(load_float(both, top), load_float(both, bottom), hn::Set(both, places.y[i]));
    const auto left = hn::LowerHalf(d, down), right = hn::UpperHalf(d, down);
#else
    const auto y = hn::Set(d, places.y[i]);
    const auto left = mix_float(load_float(d, top), load_float(d, bottom), y),
               right = mix_float(load_float(d, top + 4), load_float(d, bottom + 4), y);
#endif
    hn::StoreU(mix_float(left, right, hn::Set(d, places.x[i])), d, out + 4 * i);
  }
}

template <class T>
void bilinear1(const T* patch, std::int32_t pitch, const Places& places, int count, float* out) {
  const Staged<T> staged(patch, pitch, places, count);
  alignas(64) float left[row_px], right[row_px];
  for (int i = 0; i < count; ++i) {
    left[i] = lerp(static_cast<float>(staged.top[2 * i]), static_cast<float>(staged.bottom[2 * i]), places.y[i]);
    right[i] =
        lerp(static_cast<float>(staged.top[2 * i + 1]), static_cast<float>(staged.bottom[2 * i + 1]), places.y[i]);
  }
  for (int i = 0; i < count; ++i) out[i] = lerp(left[i], right[i], places.x[i]);
}

template <class T>
void cubic4(const T* patch, std::int32_t pitch, const Places& places, int count, float* out) {
  const hn::FixedTag<float, 4> d;
  const CubicWeights across(places.x, count), down(places.y, count);
  for (int i = 0; i < count; ++i) {
    const std::ptrdiff_t row = 4 * static_cast<std::ptrdiff_t>(pitch);
    const T* first = patch + 4 * static_cast<std::ptrdiff_t>(places.at[i]) - row - 4;
    const auto columns = [&](auto tag, const T* from) {
      auto sum = hn::Mul(hn::Set(tag, down.w[0][i]), load_float(tag, from));
      for (int j = 1; j < 4; ++j)
        sum = hn::Add(sum, hn::Mul(hn::Set(tag, down.w[j][i]), load_float(tag, from + j * row)));
      return sum;
    };
    const auto times = [&](auto column, int j) { return hn::Mul(column, hn::Set(d, across.w[j][i])); };
#if HWY_MAX_BYTES >= 32
    const hn::FixedTag<float, 8> two;
    const auto ab = columns(two, first), ce = columns(two, first + 8);
    auto sum = hn::Add(times(hn::LowerHalf(d, ab), 0), times(hn::UpperHalf(d, ab), 1));
    sum = hn::Add(sum, times(hn::LowerHalf(d, ce), 2));
    sum = hn::Add(sum, times(hn::UpperHalf(d, ce), 3));
#else
    auto sum = times(columns(d, first), 0);
    for (int j = 1; j < 4; ++j) sum = hn::Add(sum, times(columns(d, first + 4 * j), j));
#endif
    hn::StoreU(sum, d, out + 4 * i);
  }
}

template <class T>
void cubic1(const T* patch, std::int32_t pitch, const Places& places, int count, float* out) {
  const CubicWeights across(places.x, count), down(places.y, count);
  const hn::FixedTag<float, 4> d;
  alignas(16) float columns[4 * row_px];
  for (int i = 0; i < count; ++i) {
    const T* first = patch + static_cast<std::ptrdiff_t>(places.at[i]) - pitch - 1;
    auto sum = hn::Mul(hn::Set(d, down.w[0][i]), load_float(d, first));
    for (int j = 1; j < 4; ++j)
      sum = hn::Add(sum,
                    hn::Mul(hn::Set(d, down.w[j][i]), load_float(d, first + static_cast<std::ptrdiff_t>(j) * pitch)));
    hn::Store(sum, d, columns + 4 * i);
  }
  for (int i = 0; i < count; ++i) {
    const float* column = columns + 4 * i;
    out[i] = column[0] * across.w[0][i] + column[1] * across.w[1][i] + column[2] * across.w[2][i] +
             column[3] * across.w[3][i];
  }
}

// ---- levels

void blend_fixed(const std::int16_t* coarse, const std::int16_t* shares, int count, std::int16_t* values) {
  const hn::CappedTag<std::int16_t, row_px> d;
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d)))
    hn::StoreU(mix_fixed(hn::LoadU(d, values + i), hn::LoadU(d, coarse + i), hn::LoadU(d, shares + i)), d, values + i);
}
void blend(const float* coarse, const float* shares, int count, float* values) {
  blend_values(coarse, shares, count, values);
}

void add_fixed(const std::int16_t* values, int count, std::int32_t* sums) { add_values(values, count, sums); }
void add(const float* values, int count, float* sums) { add_values(values, count, sums); }

// ---- texels in and out

/// Whole vectors, then the rest by the definition's loop.
template <class T>
void round(const float* values, int count, float scale, T* out) {
  int i = 0;
  if constexpr (!std::is_same_v<T, float>) {
    constexpr float lowest = std::numeric_limits<T>::min(), highest = std::numeric_limits<T>::max();
    const hn::CappedTag<float, row_px> d;
    const hn::Rebind<std::int32_t, decltype(d)> di;
    const hn::Rebind<T, decltype(d)> dt;
    const auto low = hn::Set(d, lowest), high = hn::Set(d, highest), half = hn::Set(d, 0.5f), by = hn::Set(d, scale);
    const auto low_whole = hn::Set(di, static_cast<std::int32_t>(lowest));
    for (const int n = static_cast<int>(hn::Lanes(d)); i + n <= count; i += n) {
      const auto held = hn::Min(hn::Max(hn::Mul(hn::LoadU(d, values + i), by), low), high);
      const auto whole = hn::Add(hn::ConvertTo(di, hn::Add(hn::Sub(held, low), half)), low_whole);
      hn::StoreU(hn::DemoteTo(dt, whole), dt, out + i);
    }
  }
  round_values(values + i, count - i, scale, out + i);
}
void round_fixed(const std::int16_t* values, int count, std::uint8_t* out) { round_fixed_values(values, count, out); }
void round_sums(const std::int32_t* sums, int count, float scale, std::uint8_t* out) {
  round_fixed_sums(sums, count, scale, out);
}

alignas(16) constexpr std::uint8_t wide[16] = {0, 1, 2, 0x80, 3, 4, 5, 0x80, 6, 7, 8, 0x80, 9, 10, 11, 0x80};

/// Of the 48 bytes of 16 texels of three, in thirds: which byte of the first and of the second vector of four texels of
/// four that hold a third, and 0x80 where it is in the other.
struct Narrow {
  constexpr Narrow() {
    for (int byte = 0; byte < 48; ++byte) {
      const int k = byte / 16, texel = byte / 3, vector = texel / 4;
      first[k][byte % 16] = second[k][byte % 16] = 0x80;
      (vector == k ? first : second)[k][byte % 16] = static_cast<std::uint8_t>(4 * (texel % 4) + byte % 3);
    }
  }
  alignas(16) std::uint8_t first[3][16] = {}, second[3][16] = {};
};
constexpr Narrow narrow;

void widen3(const std::uint8_t* texels, int count, std::uint8_t* out) {
  const hn::FixedTag<std::uint8_t, 16> d;
  const auto table = hn::Load(d, wide);
  const auto opaque = hn::BitCast(d, hn::Set(hn::FixedTag<std::uint32_t, 4>(), 0xff000000u));
  int i = 0;
  for (; i + 6 <= count; i += 4)  // reads five texels and a third
    hn::StoreU(hn::Or(hn::TableLookupBytesOr0(hn::LoadU(d, texels + 3 * i), table), opaque), d, out + 4 * i);
  scalar_kernels().widen3(texels + 3 * i, count - i, out + 4 * i);
}

void narrow3(const std::uint8_t* texels, int count, std::uint8_t* out) {
  const hn::FixedTag<std::uint8_t, 16> d;
  int i = 0;
  for (; i + 16 <= count; i += 16)
    for (int k = 0; k < 3; ++k) {  // each third of 48 bytes lies in two of four vectors
      const auto of = [&](int vector, const std::uint8_t* bytes) {
        return hn::TableLookupBytesOr0(hn::LoadU(d, texels + 4 * i + 16 * vector), hn::Load(d, bytes));
      };
      hn::StoreU(hn::Or(of(k, narrow.first[k]), of(k + 1, narrow.second[k])), d, out + 3 * i + 16 * k);
    }
  scalar_kernels().narrow3(texels + 4 * i, count - i, out + 3 * i);
}

}  // namespace

const Kernels* table() {
  static const Kernels kernels = {
      hwy::TargetName(HWY_TARGET),
      project,
      place_fixed,
      place,
      place_row_fixed,
      place_row,
      {bilinear4_bytes, bilinear1_bytes, cubic4<std::uint8_t>, cubic1<std::uint8_t>, round<std::uint8_t>},
      {bilinear4<std::int16_t>, bilinear1<std::int16_t>, cubic4<std::int16_t>, cubic1<std::int16_t>,
       round<std::int16_t>},
      {bilinear4<std::uint16_t>, bilinear1<std::uint16_t>, cubic4<std::uint16_t>, cubic1<std::uint16_t>,
       round<std::uint16_t>},
      {bilinear4<float>, bilinear1<float>, cubic4<float>, cubic1<float>, round<float>},
      blend_fixed,
      blend,
      add_fixed,
      add,
      round_fixed,
      round_sums,
      widen3,
      narrow3};
  return &kernels;
}
#endif

}  // namespace HWY_NAMESPACE
}  // namespace nadir::render
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nadir::render {
HWY_EXPORT(table);

std::vector<const Kernels*> vector_kernels() {
  static const std::vector<const Kernels*> all = [] {
    std::vector<const Kernels*> found;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {  // the best come first
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().Update(hwy::SupportedTargets());
      const Kernels* kernels = HWY_DYNAMIC_DISPATCH(table)();
      if (kernels != &scalar_kernels()) found.insert(found.begin(), kernels);
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    return found;
  }();
  return all;
}

}  // namespace nadir::render
#endif

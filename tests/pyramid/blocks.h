#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "nadir/mosaic/validity.h"
#include "reduction.h"

namespace nadir::pyramid {

using tiff::Sample;

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// How the texels of a test tell what is missing.
enum class Holes { None, Mask, Nodata, Alpha, AlphaAndMask };
inline constexpr std::array all_holes = {Holes::None, Holes::Mask, Holes::Nodata, Holes::Alpha, Holes::AlphaAndMask};
inline constexpr std::array all_samples = {Sample::U8,  Sample::I8,  Sample::U16, Sample::I16, Sample::U32,
                                           Sample::I32, Sample::U64, Sample::I64, Sample::F32, Sample::F64};
inline LevelSize half(LevelSize fine) { return {fine.width - fine.width / 2, fine.height - fine.height / 2}; }
inline Window all_of(LevelSize size) { return {0, 0, size.width, size.height}; }

inline TexelType texel_type(Sample sample, int bands, Holes holes) {
  TexelType type{sample, bands, holes == Holes::Alpha || holes == Holes::AlphaAndMask,
                 holes == Holes::Mask || holes == Holes::AlphaAndMask, std::nullopt};
  if (holes == Holes::Nodata) type.nodata = 7;
  return type;
}

template <class T>
T& sample_at(Block& block, const TexelType& type, std::int32_t x, std::int32_t y, int band) {
  return reinterpret_cast<T*>(block.row(y))[(x - block.window().x) * type.bands + band];
}
template <class T>
T sample_at(const Block& block, const TexelType& type, std::int32_t x, std::int32_t y, int band) {
  return sample_at<T>(const_cast<Block&>(block), type, x, y, band);
}

/// Samples over the whole range of small types and over many steps of others; about `missing` of 8 texels hold nothing.
inline Block random_block(const TexelType& type, const Window& window, unsigned seed, unsigned missing,
                          unsigned values = 0) {
  std::mt19937 random(seed);
  Block block(type, window);
  tiff::with_sample(type.sample, [&]<class T>(T) {
    for (std::int32_t y = window.y; y < window.y + window.height; ++y) {
      for (std::int32_t x = window.x; x < window.x + window.width; ++x) {
        const bool hole = random() % 8 < missing;
        for (int b = 0; b < type.bands; ++b) {
          const std::uint64_t bits = (std::uint64_t{random()} << 32) | random();
          T& sample = sample_at<T>(block, type, x, y, b);
          if constexpr (std::is_floating_point_v<T>)
            sample = static_cast<T>(static_cast<double>(static_cast<std::int64_t>(bits)) * 0x1p-50);
          else
            sample = static_cast<T>(bits);
          if (values > 0) sample = static_cast<T>(bits % values);
          if (type.nodata && (hole || random() % 16 < missing)) sample = static_cast<T>(*type.nodata);
          if (std::is_floating_point_v<T> && missing > 0 && random() % 16 == 0)
            sample = static_cast<T>(random() % 2 ? nan : -std::numeric_limits<double>::infinity());
          if (type.alpha && b == type.bands - 1) {
            const T opaque = mosaic::Validity<T>::opaque();
            sample = hole ? T{} : random() % 2 ? opaque : static_cast<T>(opaque / static_cast<T>(3));
          }
        }
        if (block.masked()) block.valid_row(y)[x - window.x] = hole && random() % 2 ? 0 : 255;
      }
    }
  });
  return block;
}

}  // namespace nadir::pyramid

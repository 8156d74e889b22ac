#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace nadir::render {

/// Pixels of a row that are sampled together. All arrays of a row hold as many, of which kernels may read and write
/// whole vectors.
inline constexpr int row_px = 64;

/// What a pixel's bilinear sample is while it is worked on. Of bytes: units of 1/128, so that the greatest, 255 * 128,
/// and all differences fit 16 bits. Of all other types: float.
template <class T>
using Bilinear = std::conditional_t<std::is_same_v<T, std::uint8_t>, std::int16_t, float>;
inline constexpr int fixed_one_log2 = 7, fixed_one = 1 << fixed_one_log2;

/// Fractions of 15 bits, in products rounded to nearest, ties up: (a * b + 2^14) / 2^15.
inline constexpr int fraction_bits = 15;

/// Texels, in a row of pixels: (u0 + x (u1 + x u2)) / (w0 + x w1), likewise v.
struct RowPath {
  double u0 = 0, u1 = 0, u2 = 0, v0 = 0, v1 = 0, v2 = 0, w0 = 1, w1 = 0;
};

/// From such texels to those of a patch: x = u * scale_x + offset_x, held within [low, high_x]; what is not a number
/// becomes `low`.
struct PatchFrame {
  double scale_x = 1, scale_y = 1, offset_x = 0, offset_y = 0;
  double low = 0, high_x = 0, high_y = 0;
  std::int32_t pitch = 0;  // texels a row of the patch
};

/// Pixels of a row in a patch, about their middle: x = col + x + d (slope_x + d bend_x) / (1 + d turn), y likewise, d
/// counting pixels from there. In single precision, so that what is added to `col` and `row` stays below
/// `most_from_middle`: 2.3e-5 texels off at most (six roundings).
struct PatchRow {
  std::int32_t col = 0, row = 0;
  float x = 0, y = 0;
  float slope_x = 0, slope_y = 0, bend_x = 0, bend_y = 0, turn = 0;
  float first = 0;  // d of the first pixel
};
inline constexpr double most_from_middle = 64;

/// Where the samples of a row lie in a patch.
struct Places {
  alignas(64) std::int32_t at[row_px] = {};                     // row * pitch + column of the texel left and above
  alignas(64) std::int16_t x15[row_px] = {}, y15[row_px] = {};  // fractions of the way to the next, of 15 bits ...
  alignas(64) float x[row_px] = {}, y[row_px] = {};             // ... or as they are
};

/// Samples of a row from one group of a patch's channels. Four channels lie together, or there is one.
/// Bilinear: down, then across, each as a + (b - a) * fraction. Cubic: Keys' convolution, down, then across, its terms
/// added from the first to the last.
template <class T>
struct TypeKernels {
  void (*bilinear4)(const T* patch, std::int32_t pitch, const Places& places, int count, Bilinear<T>* out);
  void (*bilinear1)(const T* patch, std::int32_t pitch, const Places& places, int count, Bilinear<T>* out);
  void (*cubic4)(const T* patch, std::int32_t pitch, const Places& places, int count, float* out);
  void (*cubic1)(const T* patch, std::int32_t pitch, const Places& places, int count, float* out);
  /// `values` times `scale`, to nearest, ties up, within the type's range.
  void (*round)(const float* values, int count, float scale, T* out);
};

/// The inner loops of sampling, for one instruction set. All give the bits of the definition, `scalar_kernels`: they
/// take the same steps, and none fuses a product with a sum.
struct Kernels {
  const char* name;
  void (*project)(const RowPath& path, double first, int count, double* u, double* v);
  void (*place_fixed)(const double* u, const double* v, const PatchFrame& frame, int count, Places& places);
  void (*place)(const double* u, const double* v, const PatchFrame& frame, int count, Places& places);
  /// Likewise, held as those are.
  void (*place_row_fixed)(const PatchRow& row, const PatchFrame& frame, int count, Places& places);
  void (*place_row)(const PatchRow& row, const PatchFrame& frame, int count, Places& places);
  TypeKernels<std::uint8_t> uint8;
  TypeKernels<std::int16_t> int16;
  TypeKernels<std::uint16_t> uint16;
  TypeKernels<float> float32;
  /// Brings `values` a `share` of the way to `coarse`.
  void (*blend_fixed)(const std::int16_t* coarse, const std::int16_t* shares, int count, std::int16_t* values);
  void (*blend)(const float* coarse, const float* shares, int count, float* values);
  void (*add_fixed)(const std::int16_t* values, int count, std::int32_t* sums);
  void (*add)(const float* values, int count, float* sums);
  void (*round_fixed)(const std::int16_t* values, int count, std::uint8_t* out);
  void (*round_sums)(const std::int32_t* sums, int count, float scale, std::uint8_t* out);
  /// Texels of three bytes to texels of four, the last 255, and back.
  void (*widen3)(const std::uint8_t* texels, int count, std::uint8_t* out);
  void (*narrow3)(const std::uint8_t* texels, int count, std::uint8_t* out);

  template <class T>
  const TypeKernels<T>& of() const {
    if constexpr (std::is_same_v<T, std::uint8_t>)
      return uint8;
    else if constexpr (std::is_same_v<T, std::int16_t>)
      return int16;
    else if constexpr (std::is_same_v<T, std::uint16_t>)
      return uint16;
    else
      return float32;
  }
};

/// The definition, in plain arithmetic.
const Kernels& scalar_kernels();

/// All that this machine can run, the definition first and the fastest last.
std::vector<const Kernels*> all_kernels();

/// The fastest; the definition where the environment says NADIR_SIMD=off.
const Kernels& best_kernels();

}  // namespace nadir::render

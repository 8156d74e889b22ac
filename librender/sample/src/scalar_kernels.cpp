#include <cmath>
#include <cstring>

#include "kernels.h"
#include "row_math.h"

namespace nadir::render {
namespace {

void project(const RowPath& path, double first, int count, double* u, double* v) {
  for (int i = 0; i < count; ++i) {
    const double x = first + i;
    const double over_w = 1 / (path.w0 + x * path.w1);
    u[i] = (path.u0 + x * (path.u1 + x * path.u2)) * over_w;
    v[i] = (path.v0 + x * (path.v1 + x * path.v2)) * over_w;
  }
}

double hold(double x, double low, double high) { return std::min(x >= low ? x : low, high); }

void place_fixed(const double* u, const double* v, const PatchFrame& frame, int count, Places& places) {
  constexpr int one = 1 << fraction_bits;
  for (int i = 0; i < count; ++i) {
    const double x = hold(u[i] * frame.scale_x + frame.offset_x, frame.low, frame.high_x),
                 y = hold(v[i] * frame.scale_y + frame.offset_y, frame.low, frame.high_y);
    const auto fixed_x = static_cast<std::int32_t>(x * one + 0.5), fixed_y = static_cast<std::int32_t>(y * one + 0.5);
    places.at[i] = (fixed_y >> fraction_bits) * frame.pitch + (fixed_x >> fraction_bits);
    places.x15[i] = static_cast<std::int16_t>(fixed_x & (one - 1));
    places.y15[i] = static_cast<std::int16_t>(fixed_y & (one - 1));
  }
}

void place(const double* u, const double* v, const PatchFrame& frame, int count, Places& places) {
  for (int i = 0; i < count; ++i) {
    const double x = hold(u[i] * frame.scale_x + frame.offset_x, frame.low, frame.high_x),
                 y = hold(v[i] * frame.scale_y + frame.offset_y, frame.low, frame.high_y);
    const auto col = static_cast<std::int32_t>(x), row = static_cast<std::int32_t>(y);
    places.at[i] = row * frame.pitch + col;
    places.x[i] = static_cast<float>(x - col);
    places.y[i] = static_cast<float>(y - row);
  }
}

/// Of pixel i, from the row's `col` and `row`.
struct RowPoint {
  RowPoint(const PatchRow& of, const PatchFrame& frame, int i) {
    const float d = of.first + static_cast<float>(i), over = 1 / (1 + d * of.turn);
    const auto held = [&](float middle, float slope, float bend, double low, double high, std::int32_t from) {
      const float at = middle + d * (slope + d * bend) * over;
      return std::min(std::max(at, static_cast<float>(low - from)), static_cast<float>(high - from));
    };
    x = held(of.x, of.slope_x, of.bend_x, frame.low, frame.high_x, of.col);
    y = held(of.y, of.slope_y, of.bend_y, frame.low, frame.high_y, of.row);
  }
  float x, y;
};

void place_row_fixed(const PatchRow& of, const PatchFrame& frame, int count, Places& places) {
  constexpr int one = 1 << fraction_bits;
  for (int i = 0; i < count; ++i) {
    const RowPoint at(of, frame, i);
    const auto x = static_cast<std::int32_t>(std::lrint(at.x * one)) + of.col * one,
               y = static_cast<std::int32_t>(std::lrint(at.y * one)) + of.row * one;
    places.at[i] = (y >> fraction_bits) * frame.pitch + (x >> fraction_bits);
    places.x15[i] = static_cast<std::int16_t>(x & (one - 1));
    places.y15[i] = static_cast<std::int16_t>(y & (one - 1));
  }
}

void place_row(const PatchRow& of, const PatchFrame& frame, int count, Places& places) {
  for (int i = 0; i < count; ++i) {
    const RowPoint at(of, frame, i);
    const float col = std::floor(at.x), row = std::floor(at.y);
    places.at[i] = (static_cast<std::int32_t>(row) + of.row) * frame.pitch + static_cast<std::int32_t>(col) + of.col;
    places.x[i] = at.x - col;
    places.y[i] = at.y - row;
  }
}

template <class T, int Channels>
void bilinear(const T* patch, std::int32_t pitch, const Places& places, int count, Bilinear<T>* out) {
  for (int i = 0; i < count; ++i) {
    const T* top = patch + static_cast<std::ptrdiff_t>(places.at[i]) * Channels;
    const T* bottom = top + static_cast<std::ptrdiff_t>(pitch) * Channels;
    for (int c = 0; c < Channels; ++c) {
      if constexpr (std::is_same_v<T, std::uint8_t>) {
        const auto down = [&](int at) {
          return lerp_fixed(static_cast<std::int16_t>(top[at] * fixed_one),
                            static_cast<std::int16_t>(bottom[at] * fixed_one), places.y15[i]);
        };
        out[Channels * i + c] = lerp_fixed(down(c), down(c + Channels), places.x15[i]);
      } else {
        const auto down = [&](int at) {
          return lerp(static_cast<float>(top[at]), static_cast<float>(bottom[at]), places.y[i]);
        };
        out[Channels * i + c] = lerp(down(c), down(c + Channels), places.x[i]);
      }
    }
  }
}

template <class T, int Channels>
void cubic(const T* patch, std::int32_t pitch, const Places& places, int count, float* out) {
  const CubicWeights across(places.x, count), down(places.y, count);
  for (int i = 0; i < count; ++i) {
    const T* first = patch + (static_cast<std::ptrdiff_t>(places.at[i]) - pitch - 1) * Channels;
    for (int c = 0; c < Channels; ++c) {
      float sum = 0;
      for (int col = 0; col < 4; ++col) {
        float column = 0;
        for (int row = 0; row < 4; ++row) {
          const float term = down.w[row][i] *
                             static_cast<float>(first[(static_cast<std::ptrdiff_t>(row) * pitch + col) * Channels + c]);
          column = row == 0 ? term : column + term;
        }
        const float term = column * across.w[col][i];
        sum = col == 0 ? term : sum + term;
      }
      out[Channels * i + c] = sum;
    }
  }
}

void blend_fixed(const std::int16_t* coarse, const std::int16_t* shares, int count, std::int16_t* values) {
  for (int i = 0; i < count; ++i) values[i] = lerp_fixed(values[i], coarse[i], shares[i]);
}
void blend(const float* coarse, const float* shares, int count, float* values) {
  blend_values(coarse, shares, count, values);
}

void add_fixed(const std::int16_t* values, int count, std::int32_t* sums) { add_values(values, count, sums); }
void add(const float* values, int count, float* sums) { add_values(values, count, sums); }

void widen3(const std::uint8_t* texels, int count, std::uint8_t* out) {
  for (int i = 0; i < count; ++i) {
    std::memcpy(out + 4 * i, texels + 3 * i, 3);
    out[4 * i + 3] = 255;
  }
}

void narrow3(const std::uint8_t* texels, int count, std::uint8_t* out) {
  for (int i = 0; i < count; ++i) std::memcpy(out + 3 * i, texels + 4 * i, 3);
}

template <class T>
void round(const float* values, int count, float scale, T* out) {
  round_values(values, count, scale, out);
}
void round_fixed(const std::int16_t* values, int count, std::uint8_t* out) { round_fixed_values(values, count, out); }
void round_sums(const std::int32_t* sums, int count, float scale, std::uint8_t* out) {
  round_fixed_sums(sums, count, scale, out);
}

template <class T>
constexpr TypeKernels<T> type_kernels = {bilinear<T, 4>, bilinear<T, 1>, cubic<T, 4>, cubic<T, 1>, round<T>};

}  // namespace

const Kernels& scalar_kernels() {
  static constexpr Kernels kernels = {"scalar",
                                      project,
                                      place_fixed,
                                      place,
                                      place_row_fixed,
                                      place_row,
                                      type_kernels<std::uint8_t>,
                                      type_kernels<std::int16_t>,
                                      type_kernels<std::uint16_t>,
                                      type_kernels<float>,
                                      blend_fixed,
                                      blend,
                                      add_fixed,
                                      add,
                                      round_fixed,
                                      round_sums,
                                      widen3,
                                      narrow3};
  return kernels;
}

}  // namespace nadir::render

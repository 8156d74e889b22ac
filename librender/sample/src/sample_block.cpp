#include "nadir/render/sample_block.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace nadir::render {
namespace {

using tile::cell_apron, tile::cell_size, tile::cell_size_log2, tile::cell_stride;

constexpr int most_bands = 64;  // accumulated at once; more are sampled in turns

/// Texel coordinates relative to a window's first cell.
struct WindowFrame {
  explicit WindowFrame(const LevelWindow& w)
      : window(w),
        per_texel_x(1 / w.texels_x),
        per_texel_y(1 / w.texels_y),
        first_x(static_cast<double>(w.first_col) * cell_size),
        first_y(static_cast<double>(w.first_row) * cell_size) {}
  const LevelWindow& window;
  double per_texel_x, per_texel_y, first_x, first_y;
};

/// Cell and position in it of the texel whose index is `i`, relative to the window, along one axis. One before the
/// first and one past the last lie in the apron.
struct CellIndex {
  CellIndex(int i, int cells)
      : cell(std::clamp(i >> cell_size_log2, 0, cells - 1)),
        at(std::clamp(i - (cell << cell_size_log2) + cell_apron, 0, cell_stride - 2)) {}
  int cell, at;
};

/// Weighted sums of one pixel. A local of the loop, so that they stay in registers: stores of bytes might alias a
/// member.
template <int FixedBands>
struct Accumulator {
  float sum[FixedBands > 0 ? FixedBands : most_bands];
  float total;  // weight of the valid texels
};

template <class T, int FixedBands, bool Masked>
class BlockSampler {
  using Sums = Accumulator<FixedBands>;

 public:
  BlockSampler(const BlockSampling& block, int all_bands, int first_band, int bands)
      : block_(block), all_bands_(all_bands), first_band_(first_band), bands_(bands) {
    for (const LevelWindow& w : block.levels) frames_.emplace_back(w);
    weight_ = 1.0f / static_cast<float>(block.samples_x * block.samples_y);
  }

  void run(T* out, std::uint8_t* validity, std::size_t stride_px, bool decibel) {
    for (int y = 0; y < block_.height; ++y) {
      T* row = out + static_cast<std::size_t>(y) * stride_px * static_cast<std::size_t>(all_bands_) + first_band_;
      std::uint8_t* row_validity = validity + static_cast<std::size_t>(y) * stride_px;
      // Level coordinate along this row of pixel centres
      const double down = (y + 0.5) / block_.height;
      const double left = block_.level_at_corner[0] + down * (block_.level_at_corner[3] - block_.level_at_corner[0]);
      const double right = block_.level_at_corner[1] + down * (block_.level_at_corner[2] - block_.level_at_corner[1]);
      const double step = (right - left) / block_.width;
      for (int x = 0; x < block_.width; ++x) {
        Sums sums;
        const bool valid = pixel(x, y, static_cast<float>(left + step * (x + 0.5)), sums);
        store(row + static_cast<std::ptrdiff_t>(x) * all_bands_, valid, decibel, sums);
        row_validity[x] = valid;
      }
    }
  }

 private:
  int bands() const { return FixedBands > 0 ? FixedBands : bands_; }

  /// Adds the pixel up; false where it is not valid.
  bool pixel(int x, int y, float level, Sums& sums) const {
    double u = 0, v = 0;
    Eigen::Matrix2d jacobian;
    const bool several = block_.samples_x * block_.samples_y > 1;
    if (block_.biquadratic) {
      const Eigen::Vector2d at(x + 0.5, y + 0.5), texel = block_.texel_origin + (*block_.biquadratic)(at);
      u = texel.x();
      v = texel.y();
      if (several) jacobian = block_.biquadratic->jacobian(at);
    } else if (block_.texels.empty()) {
      const Eigen::Matrix3d& h = block_.texel_from_image;
      const double px = x + 0.5, py = y + 0.5;
      const double over_w = 1 / (h(2, 0) * px + h(2, 1) * py + h(2, 2));
      const double du = (h(0, 0) * px + h(0, 1) * py + h(0, 2)) * over_w,
                   dv = (h(1, 0) * px + h(1, 1) * py + h(1, 2)) * over_w;
      if (several)
        jacobian << (h(0, 0) - du * h(2, 0)) * over_w, (h(0, 1) - du * h(2, 1)) * over_w,  //
            (h(1, 0) - dv * h(2, 0)) * over_w, (h(1, 1) - dv * h(2, 1)) * over_w;
      u = block_.texel_origin.x() + du;
      v = block_.texel_origin.y() + dv;
    } else {
      const Eigen::Vector2d& texel =
          block_.texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(block_.width) +
                        static_cast<std::size_t>(x)];
      u = texel.x();
      v = texel.y();
      jacobian = block_.jacobian;
    }
    if (!block_.inside && !(u >= 0 && v >= 0 && u <= block_.map_width && v <= block_.map_height)) return false;

    std::fill_n(sums.sum, bands(), 0.0f);
    sums.total = 0;
    // The two levels around the coordinate
    const int last = static_cast<int>(frames_.size()) - 1;
    const float above_finest = level - static_cast<float>(block_.levels[0].level);
    if (block_.nearest) {
      nearest(frames_[static_cast<std::size_t>(std::clamp(static_cast<int>(above_finest + 0.5f), 0, last))], u, v,
              sums);
      return sums.total >= 0.5f;
    }
    const int finer = std::clamp(static_cast<int>(above_finest), 0, last);
    const float blend = finer < last ? std::clamp(above_finest - static_cast<float>(finer), 0.0f, 1.0f) : 0.0f;
    const WindowFrame& fine = frames_[static_cast<std::size_t>(finer)];

    for (int j = 0; j < block_.samples_y; ++j) {
      for (int i = 0; i < block_.samples_x; ++i) {
        double su = u, sv = v;
        if (several) {
          const double ox = (i + 0.5) / block_.samples_x - 0.5, oy = (j + 0.5) / block_.samples_y - 0.5;
          su = std::clamp(u + jacobian(0, 0) * ox + jacobian(0, 1) * oy, 0.0, block_.map_width);
          sv = std::clamp(v + jacobian(1, 0) * ox + jacobian(1, 1) * oy, 0.0, block_.map_height);
        }
        if (blend < 1) bilinear(fine, su, sv, weight_ * (1 - blend), sums);
        if (blend > 0) bilinear(frames_[static_cast<std::size_t>(finer) + 1], su, sv, weight_ * blend, sums);
      }
    }
    return sums.total >= 0.5f;
  }

  [[gnu::always_inline]] void bilinear(const WindowFrame& frame, double u, double v, float weight, Sums& sums) const {
    // Whole texels in double; only the fraction between two of them becomes float.
    const double x = std::max(u * frame.per_texel_x - frame.first_x - 0.5, -1.0);
    const double y = std::max(v * frame.per_texel_y - frame.first_y - 0.5, -1.0);
    const int ix = static_cast<int>(x + 1) - 1, iy = static_cast<int>(y + 1) - 1;
    const float fx = static_cast<float>(x - ix), fy = static_cast<float>(y - iy);
    const CellIndex cx(ix, frame.window.cols), cy(iy, frame.window.rows);
    const tile::Cell& cell =
        *frame.window.cells[static_cast<std::size_t>(cy.cell) * static_cast<std::size_t>(frame.window.cols) +
                            static_cast<std::size_t>(cx.cell)];

    const std::size_t at = static_cast<std::size_t>(cy.at) * cell_stride + static_cast<std::size_t>(cx.at);
    float w[4] = {(1 - fx) * (1 - fy) * weight, fx * (1 - fy) * weight, (1 - fx) * fy * weight, fx * fy * weight};
    if constexpr (Masked) {
      if (cell.masked()) {
        const std::uint8_t* valid = cell.validity() + at;
        w[0] *= valid[0], w[1] *= valid[1], w[2] *= valid[cell_stride], w[3] *= valid[cell_stride + 1];
      }
      sums.total += w[0] + w[1] + w[2] + w[3];
    } else {
      sums.total += weight;
    }
    const int pitch = FixedBands > 0 ? FixedBands : all_bands_;
    const T* top = cell.data<T>() + at * static_cast<std::size_t>(pitch) + first_band_;
    const T* bottom = top + static_cast<std::size_t>(cell_stride) * static_cast<std::size_t>(pitch);
    for (int b = 0; b < bands(); ++b)
      sums.sum[b] += w[0] * static_cast<float>(top[b]) + w[1] * static_cast<float>(top[b + pitch]) +
                     (w[2] * static_cast<float>(bottom[b]) + w[3] * static_cast<float>(bottom[b + pitch]));
  }

  void nearest(const WindowFrame& frame, double u, double v, Sums& sums) const {
    const CellIndex cx(static_cast<int>(std::max(u * frame.per_texel_x - frame.first_x, 0.0)), frame.window.cols);
    const CellIndex cy(static_cast<int>(std::max(v * frame.per_texel_y - frame.first_y, 0.0)), frame.window.rows);
    const tile::Cell& cell =
        *frame.window.cells[static_cast<std::size_t>(cy.cell) * static_cast<std::size_t>(frame.window.cols) +
                            static_cast<std::size_t>(cx.cell)];
    const std::size_t at = static_cast<std::size_t>(cy.at) * cell_stride + static_cast<std::size_t>(cx.at);
    if (Masked && cell.masked() && !cell.validity()[at]) return;
    sums.total = 1;
    const T* texel = cell.data<T>() + at * static_cast<std::size_t>(all_bands_) + first_band_;
    for (int b = 0; b < bands(); ++b) sums.sum[b] = static_cast<float>(texel[b]);
  }

  void store(T* out, bool valid, bool decibel, const Sums& sums) const {
    for (int b = 0; b < bands(); ++b) {
      const float mean = valid ? sums.sum[b] / sums.total : 0.0f;
      if constexpr (std::is_floating_point_v<T>) {
        out[b] = decibel && valid ? 10.0f * std::log10(mean) : mean;
      } else {
        constexpr float lowest = std::numeric_limits<T>::min();
        out[b] = static_cast<T>(static_cast<int>(mean - lowest + 0.5f) + static_cast<int>(lowest));
      }
    }
  }

  const BlockSampling& block_;
  const int all_bands_, first_band_, bands_;
  std::vector<WindowFrame> frames_;
  float weight_ = 1;
};

template <class T, bool Masked>
void sample_bands(const BlockSampling& block, int bands, bool decibel, T* out, std::uint8_t* validity,
                  std::size_t stride_px) {
  switch (bands) {
    case 1:
      return BlockSampler<T, 1, Masked>(block, 1, 0, 1).run(out, validity, stride_px, decibel);
    case 3:
      return BlockSampler<T, 3, Masked>(block, 3, 0, 3).run(out, validity, stride_px, decibel);
    case 4:
      return BlockSampler<T, 4, Masked>(block, 4, 0, 4).run(out, validity, stride_px, decibel);
    default:
      break;
  }
  for (int first = 0; first < bands; first += most_bands)
    BlockSampler<T, 0, Masked>(block, bands, first, std::min(most_bands, bands - first))
        .run(out, validity, stride_px, decibel);
}

}  // namespace

void sample_block(const BlockSampling& block, const tile::CellSource& source, void* out, std::uint8_t* validity,
                  std::size_t stride_px) {
  const int bands = static_cast<int>(source.bands().size());
  const bool decibel = source.domain() == tile::Domain::Decibel;
  tile::with_sample_type(source.type(), [&]<class T>(T) {
    if (block.masked)
      sample_bands<T, true>(block, bands, decibel, static_cast<T*>(out), validity, stride_px);
    else
      sample_bands<T, false>(block, bands, decibel, static_cast<T*>(out), validity, stride_px);
  });
}

}  // namespace nadir::render

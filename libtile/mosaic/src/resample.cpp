#include "resample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "nadir/mosaic/validity.h"

namespace nadir::mosaic {
namespace {

constexpr int most_samples = 8;  // along an axis of a target texel: beyond, an overview of the source is the better way

/// Samples along each axis of a target texel that is larger than the source's.
int samples_across(const PlacementOptions& options, double minification) {
  if (options.interpolation == Interpolation::Nearest || minification <= 1.2) return 1;
  return std::clamp(static_cast<int>(std::ceil(minification)), 1, most_samples);
}

/// Weights of Catmull and Rom's cubic (a = -1/2) for the samples at -1, 0, 1 and 2 around a fraction.
std::array<double, 4> cubic_weights(double t) {
  const double t2 = t * t, t3 = t2 * t;
  return {(-t3 + 2 * t2 - t) / 2, (3 * t3 - 5 * t2 + 2) / 2, (-3 * t3 + 4 * t2 + t) / 2, (t3 - t2) / 2};
}

/// Texels of one type within one call.
template <class T>
class PatchResampler {
 public:
  PatchResampler(const TexelType& type, const PlacementOptions& options, double minification, std::int64_t width,
                 std::int64_t height, const Block& source, Block& target)
      : options_(options),
        type_(type),
        validity_(without_mask(type, source)),
        width_(width),
        height_(height),
        samples_(samples_across(options, minification)),
        source_(source),
        target_(target),
        bands_(static_cast<std::size_t>(type.bands)),
        sums_(bands_),
        weights_(bands_) {
    find_whole();
  }

  void run(const MappingPatch& patch, const Window& w) {
    const std::int64_t left = std::max<std::int64_t>(patch.x, w.x), top = std::max<std::int64_t>(patch.y, w.y);
    const std::int64_t right = std::min<std::int64_t>(patch.x + patch.side, std::int64_t{w.x} + w.width);
    const std::int64_t bottom = std::min<std::int64_t>(patch.y + patch.side, std::int64_t{w.y} + w.height);
    if (left >= right || !patch.defined()) return;
    const bool quick = options_.interpolation == Interpolation::Bilinear && samples_ == 1 && !options_.power;
    for (std::int64_t y = top; y < bottom; ++y) {
      // Along a row source coordinates run evenly.
      const double v = (static_cast<double>(y - patch.y) + 0.5) / patch.side;
      const Eigen::Vector2d begin = patch.corners[0] + v * (patch.corners[2] - patch.corners[0]);
      const Eigen::Vector2d end = patch.corners[1] + v * (patch.corners[3] - patch.corners[1]);
      const Eigen::Vector2d across = (end - begin) / patch.side;
      const Eigen::Vector2d down =
          ((patch.corners[2] - patch.corners[0]) + (patch.corners[3] - patch.corners[1])) / (2.0 * patch.side);
      T* out = reinterpret_cast<T*>(target_.row(static_cast<std::int32_t>(y))) +
               static_cast<std::size_t>(left - target_.window().x) * bands_;
      std::uint8_t* valid =
          target_.masked() ? target_.valid_row(static_cast<std::int32_t>(y)) + (left - target_.window().x) : nullptr;
      for (std::int64_t x = left; x < right; ++x, out += bands_, valid += valid ? 1 : 0) {
        const Eigen::Vector2d p = begin + (static_cast<double>(x - patch.x) + 0.5) * across;
        if (!(p.x() >= 0 && p.y() >= 0 && p.x() <= static_cast<double>(width_) &&
              p.y() <= static_cast<double>(height_)))
          continue;
        if (is_border(p) && holds_data(out, valid)) continue;
        if (!(quick && bilinear_of_whole(p, out)) && !general(p, across, down, out)) continue;
        if (valid) *valid = 255;
      }
    }
  }

 private:
  /// Within half a texel of the outline samples go on as the border's: that yields to any that lie below.
  bool is_border(const Eigen::Vector2d& p) const {
    return p.x() < 0.5 || p.y() < 0.5 || p.x() > static_cast<double>(width_) - 0.5 ||
           p.y() > static_cast<double>(height_) - 0.5;
  }
  bool holds_data(const T* texel, const std::uint8_t* valid) const {
    if (valid) return *valid != 0;
    return validity_.texel(texel, nullptr) &&
           std::any_of(texel, texel + type_.data_bands(), [&](T sample) { return validity_.sample(sample); });
  }

  /// What a block without validity of its own is asked about.
  static TexelType without_mask(TexelType type, const Block& source) {
    type.mask = type.mask && source.masked();
    return type;
  }

  /// Marks texels all of whose samples count in full, unless all do.
  void find_whole() {
    if (validity_.always()) return;
    const Window& w = source_.window();
    whole_.resize(source_.texels());
    std::size_t at = 0;
    for (std::int32_t y = w.y; y < w.y + w.height; ++y) {
      const T* texel = samples_at<T>(source_, type_, w.x, y);
      const std::uint8_t* valid = valid_at(source_, w.x, y);
      for (std::int32_t x = 0; x < w.width; ++x, texel += bands_, valid += valid ? 1 : 0)
        whole_[at++] = validity_.whole(texel, valid);
    }
  }

  bool is_whole(std::int64_t x, std::int64_t y) const {
    if (whole_.empty()) return true;
    const Window& w = source_.window();
    return whole_[static_cast<std::size_t>(y - w.y) * static_cast<std::size_t>(w.width) +
                  static_cast<std::size_t>(x - w.x)];
  }

  const T* texel_at(std::int64_t x, std::int64_t y) const {
    return samples_at<T>(source_, type_, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y));
  }

  /// Four whole texels: the common case. Bytes are weighted by fractions of 1/256 texel, which is its error in place.
  bool bilinear_of_whole(const Eigen::Vector2d& p, T* out) const {
    const double px = p.x() - 0.5, py = p.y() - 0.5;
    const double fx = std::floor(px), fy = std::floor(py);
    const auto x = static_cast<std::int64_t>(fx), y = static_cast<std::int64_t>(fy);
    const std::int64_t x0 = std::max<std::int64_t>(x, 0), x1 = std::min(x + 1, width_ - 1);
    const std::int64_t y0 = std::max<std::int64_t>(y, 0), y1 = std::min(y + 1, height_ - 1);
    if (!(is_whole(x0, y0) && is_whole(x1, y0) && is_whole(x0, y1) && is_whole(x1, y1))) return false;
    const T *a = texel_at(x0, y0), *b = texel_at(x1, y0), *c = texel_at(x0, y1), *d = texel_at(x1, y1);
    if constexpr (std::is_same_v<T, std::uint8_t>) {
      const auto u = static_cast<std::uint32_t>((px - fx) * 256 + 0.5),
                 v = static_cast<std::uint32_t>((py - fy) * 256 + 0.5);
      const std::uint32_t wd = u * v, wb = u * 256 - wd, wc = v * 256 - wd, wa = 65536 - wb - wc - wd;
      for (std::size_t i = 0; i < bands_; ++i)
        out[i] = static_cast<T>((wa * a[i] + wb * b[i] + wc * c[i] + wd * d[i] + 32768) >> 16);
      if (validity_.has_nodata())
        for (std::size_t i = 0; i < bands_; ++i)
          if (out[i] == validity_.nodata()) out[i] = away_from_nodata(a[i], b[i], c[i], d[i], out[i]);
    } else {
      const double u = px - fx, v = py - fy;
      for (std::size_t i = 0; i < bands_; ++i) {
        const double top = static_cast<double>(a[i]) + u * (static_cast<double>(b[i]) - static_cast<double>(a[i]));
        const double bottom = static_cast<double>(c[i]) + u * (static_cast<double>(d[i]) - static_cast<double>(c[i]));
        out[i] = to_sample<T>(top + v * (bottom - top), validity_);
      }
    }
    return true;
  }

  /// A blend of valid samples that fell on nodata: one step towards the greater part of them.
  static T away_from_nodata(T a, T b, T c, T d, T nodata) {
    const int above = (a > nodata) + (b > nodata) + (c > nodata) + (d > nodata);
    const bool up = above >= 2 ? nodata < std::numeric_limits<T>::max() : nodata == std::numeric_limits<T>::lowest();
    return static_cast<T>(up ? nodata + 1 : nodata - 1);
  }

  /// Any samples: those that count, by their weights. False where less than half of the weight counts.
  bool general(const Eigen::Vector2d& p, const Eigen::Vector2d& across, const Eigen::Vector2d& down, T* out) {
    if (options_.interpolation == Interpolation::Nearest) return nearest(p, out);
    std::fill(sums_.begin(), sums_.end(), 0.0);
    std::fill(weights_.begin(), weights_.end(), 0.0);
    total_ = counted_ = opacity_ = 0;
    for (int j = 0; j < samples_; ++j)
      for (int i = 0; i < samples_; ++i)
        add_sample(p + ((i + 0.5) / samples_ - 0.5) * across + ((j + 0.5) / samples_ - 0.5) * down);
    if (!(counted_ >= 0.5 * total_)) return false;
    const auto data_bands = static_cast<std::size_t>(type_.data_bands());
    for (std::size_t b = 0; b < data_bands; ++b) {
      if (!(weights_[b] > 1e-9)) {
        out[b] = validity_.has_nodata() ? validity_.nodata() : nothing();
        continue;
      }
      double mean = sums_[b] / weights_[b];
      if (options_.power) mean = (10 * std::log10(std::max(mean, 1e-300)) - options_.offset) / options_.scale;
      out[b] = to_sample<T>(mean, validity_);
    }
    if (type_.alpha)
      out[data_bands] =
          static_cast<T>(std::clamp(std::is_integral_v<T> ? std::floor(opacity_ / total_ + 0.5) : opacity_ / total_,
                                    0.0, static_cast<double>(Validity<T>::opaque())));
    return true;
  }

  static T nothing() { return std::is_floating_point_v<T> ? std::numeric_limits<T>::quiet_NaN() : T{}; }

  bool nearest(const Eigen::Vector2d& p, T* out) const {
    const auto x = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(p.x())), 0, width_ - 1);
    const auto y = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(p.y())), 0, height_ - 1);
    const T* texel = texel_at(x, y);
    const auto data_bands = static_cast<std::size_t>(type_.data_bands());
    if (!validity_.texel(texel, valid_at(source_, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y))) ||
        std::none_of(texel, texel + data_bands, [&](T sample) { return validity_.sample(sample); }))
      return false;
    std::copy_n(texel, bands_, out);
    return true;
  }

  void add_sample(const Eigen::Vector2d& p) {
    const double px = p.x() - 0.5, py = p.y() - 0.5;
    const auto x = static_cast<std::int64_t>(std::floor(px)), y = static_cast<std::int64_t>(std::floor(py));
    const double u = px - std::floor(px), v = py - std::floor(py);
    if (options_.interpolation == Interpolation::Cubic) {
      const auto across = cubic_weights(u), down = cubic_weights(v);
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i)
          add_tap(x - 1 + i, y - 1 + j, across[static_cast<std::size_t>(i)] * down[static_cast<std::size_t>(j)]);
      return;
    }
    add_tap(x, y, (1 - u) * (1 - v));
    add_tap(x + 1, y, u * (1 - v));
    add_tap(x, y + 1, (1 - u) * v);
    add_tap(x + 1, y + 1, u * v);
  }

  void add_tap(std::int64_t x, std::int64_t y, double weight) {
    if (weight == 0) return;
    total_ += weight;
    // Beyond half a texel outside there is nothing; within, the border's texel goes on.
    if (x < -1 || y < -1 || x > width_ || y > height_) return;
    const Window& w = source_.window();
    x = std::clamp(std::clamp<std::int64_t>(x, 0, width_ - 1), std::int64_t{w.x}, std::int64_t{w.x} + w.width - 1);
    y = std::clamp(std::clamp<std::int64_t>(y, 0, height_ - 1), std::int64_t{w.y}, std::int64_t{w.y} + w.height - 1);
    const T* texel = texel_at(x, y);
    if (!validity_.texel(texel, valid_at(source_, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)))) return;
    const auto data_bands = static_cast<std::size_t>(type_.data_bands());
    double colour_weight = weight;
    if (type_.alpha) {
      opacity_ += weight * static_cast<double>(texel[data_bands]);
      colour_weight *= static_cast<double>(texel[data_bands]) / static_cast<double>(Validity<T>::opaque());
    }
    bool any = false;
    for (std::size_t b = 0; b < data_bands; ++b) {
      if (!validity_.sample(texel[b])) continue;
      any = true;
      double value = static_cast<double>(texel[b]);
      if (options_.power) value = std::pow(10.0, (value * options_.scale + options_.offset) / 10);
      sums_[b] += colour_weight * value;
      weights_[b] += colour_weight;
    }
    if (any) counted_ += weight;
  }

  const PlacementOptions& options_;
  const TexelType type_;
  const Validity<T> validity_;
  const std::int64_t width_, height_;
  const int samples_;
  const Block& source_;
  Block& target_;
  const std::size_t bands_;
  std::vector<std::uint8_t> whole_;  // empty: all texels are
  std::vector<double> sums_, weights_;
  double total_ = 0, counted_ = 0, opacity_ = 0;
};

}  // namespace

double reach(const PlacementOptions& options, double minification) {
  const double kernel = options.interpolation == Interpolation::Cubic ? 2 : 1;
  return kernel + (samples_across(options, minification) > 1 ? minification / 2 : 0) + options.tolerance_texels;
}

void Resampler::resample(std::span<const MappingPatch> patches, const Window& window, const Block& source,
                         Block& target) const {
  tiff::with_sample(type_.sample, [&]<class T>(T) {
    PatchResampler<T> resampler(type_, options_, minification_, width_, height_, source, target);
    for (const MappingPatch& patch : patches) resampler.run(patch, window);
  });
}

}  // namespace nadir::mosaic

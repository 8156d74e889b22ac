#include "resample.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "held.h"
#include "interpolate.h"
#include "store.h"

namespace nadir::mosaic {
namespace {

/// A row of a patch: bilinear interpolation is linear along it.
struct Row {
  Eigen::Vector2d start, step;  // texels of the source

  Row(const Patch& patch, double row)
      : start(patch.corner + row * patch.per_row), step(patch.per_column + row * patch.twist) {}
  double x(double column) const { return start.x() + column * step.x(); }
  double y(double column) const { return start.y() + column * step.y(); }
};

/// Lays samples of type S, calculated with in A, onto texels of T: the same but for decibels, which come as power.
template <bool Power, class S, class T, class A>
class Kernel {
 public:
  Kernel(const Resampling& resampling, const S* samples, const Window& window, const Held& held, Block& target)
      : type_(resampling.type),
        interpolation_(resampling.options.interpolation),
        bands_(resampling.type.bands),
        width_(resampling.source_width),
        height_(resampling.source_height),
        samples_(samples),
        window_(window),
        row_(static_cast<std::ptrdiff_t>(window.width) * resampling.type.bands),
        held_(held),
        validity_(Power ? TexelType{} : resampling.type),
        validity_below_(resampling.type),
        store_(resampling.type, resampling.options, Power),
        target_(target),
        sums_(static_cast<std::size_t>(run_texels * bands_ + 1)),
        blended_(static_cast<std::size_t>(bands_)) {}

  void lay(const Patch& patch, const Window& clip) {
    const Window part = intersection(patch.rect, clip);
    for (std::int32_t y = part.y; y < part.y + part.height; ++y)
      for (std::int32_t x = part.x; x < part.x + part.width; x += run_texels)
        run(patch, x, y, std::min(run_texels, part.x + part.width - x));
  }

 private:
  struct Tap {
    const S* texel;
    Holds holds;
    A weight;
  };

  /// `count` texels from (x, y) on: together where all that they need holds data, else one by one with the same bits.
  void run(const Patch& patch, std::int32_t x, std::int32_t y, int count) {
    const double column = x - patch.rect.x, row = y - patch.rect.y;
    if (misses(Row(patch, row + 0.5), column + 0.5, column + count - 0.5)) return;
    T* to = reinterpret_cast<T*>(target_.row(y)) + static_cast<std::ptrdiff_t>(x - target_.window().x) * bands_;
    std::uint8_t* valid = target_.masked() ? target_.valid_row(y) + (x - target_.window().x) : nullptr;
    if (interpolation_ == Interpolation::Bilinear && together(patch, column, row, count)) {
      store_.all(sums_.data(), count, to);
      if (valid) std::fill_n(valid, count, std::uint8_t{255});
      return;
    }
    for (int i = 0; i < count; ++i, to += bands_)
      if (one(patch, column + i, row, to, valid ? valid + i : nullptr) && valid) valid[i] = 255;
  }

  /// Whether all of a row between two columns lies beyond one side of the source.
  bool misses(const Row& row, double first, double last) const {
    const auto beyond = [](double a, double b, double size) { return (a < 0 && b < 0) || (a >= size && b >= size); };
    return beyond(row.x(first), row.x(last), width_) || beyond(row.y(first), row.y(last), height_);
  }

  /// Means of the bilinear samples of `count` texels into sums_; false where any needs care.
  bool together(const Patch& patch, double column, double row, int count) {
    const auto [across, down] = patch.samples;
    for (int j = 0; j < down; ++j) {
      const Row line(patch, row + (j + 0.5) / down);
      const double first = column + 0.5 / across, last = column + count - 1 + (across - 0.5) / across;
      if (!inside(line.x(first), line.x(last), width_) || !inside(line.y(first), line.y(last), height_)) return false;
    }
    for (int j = 0; j < down; ++j)
      for (int i = 0; i < across; ++i) {
        locate(Row(patch, row + (j + 0.5) / down), column, (i + 0.5) / across, count);
        if (!held_.all() && !hold_all(count)) return false;
        if (i == 0 && j == 0)
          sum<false>(count);
        else
          sum<true>(count);
      }
    if (across * down > 1)
      for (int i = 0; i < count * bands_; ++i) sums_[static_cast<std::size_t>(i)] *= A(1) / A(across * down);
    return true;
  }

  /// Whether places from `a` to `b` along an axis have two texels around them, between two in this order at least.
  static bool inside(double a, double b, std::int32_t size) {
    return std::min(a, b) >= 0.5 && std::max(a, b) - 0.5 < size - 1;
  }

  /// `share` of a texel right of the left edges of `count` texels.
  void locate(const Row& row, double column, double share, int count) {
    for (int i = 0; i < count; ++i) {
      const double place = column + i + share;  // whole columns first: the same sum wherever the run starts
      const double x = row.x(place) - 0.5, y = row.y(place) - 0.5;  // both >= 0, from the centres of texels
      const auto left = static_cast<std::int32_t>(x), top = static_cast<std::int32_t>(y);
      const auto n = static_cast<std::size_t>(i);
      places_.right[n] = static_cast<A>(x - left);
      places_.below[n] = static_cast<A>(y - top);
      places_.sample[n] = sample_offset(left, top);
    }
  }

  std::ptrdiff_t sample_offset(std::int32_t x, std::int32_t y) const {
    return (y - window_.y) * row_ + static_cast<std::ptrdiff_t>(x - window_.x) * bands_;
  }

  bool hold_all(int count) const {
    for (int i = 0; i < count; ++i) {
      const Holds* h = held_.texels() + places_.sample[static_cast<std::size_t>(i)] / bands_;
      const Holds* below = h + window_.width;
      if (std::min(std::min(h[0], h[1]), std::min(below[0], below[1])) != Holds::All) return false;
    }
    return true;
  }

  template <bool Add>
  void sum(int count) {
    if constexpr (std::is_same_v<S, std::uint8_t>) {
      if (bands_ == 3) return bilinear_run_bytes<3, Add>(samples_, row_, places_, count, sums_.data());
      if (bands_ == 4) return bilinear_run_bytes<4, Add>(samples_, row_, places_, count, sums_.data());
    }
    if (bands_ == 1) return bilinear_run<1, Add>(samples_, row_, 1, places_, count, sums_.data());
    bilinear_run<0, Add>(samples_, row_, bands_, places_, count, sums_.data());
  }

  /// The texel `column` and `row` from the patch's corner; false where the source has nothing for it.
  bool one(const Patch& patch, double column, double row, T* to, const std::uint8_t* valid) {
    const Row middle(patch, row + 0.5);
    const double x = middle.x(column + 0.5), y = middle.y(column + 0.5);
    if (!(x >= 0 && y >= 0 && x < width_ && y < height_)) return false;
    if (interpolation_ == Interpolation::Nearest) return nearest(x, y, to);
    // Beyond the outermost centres the source only repeats itself: what lies below knows better.
    const bool repeats = x < 0.5 || y < 0.5 || x > width_ - 0.5 || y > height_ - 0.5;
    if (repeats && holds_data(to, valid)) return false;
    const auto [across, down] = patch.samples;
    if (interpolation_ == Interpolation::Cubic && across * down == 1 && cubic(x - 0.5, y - 0.5, to)) return true;

    taps_.clear();
    bool all = true;
    for (int j = 0; j < down; ++j) {
      const Row line(patch, row + (j + 0.5) / down);
      for (int i = 0; i < across; ++i) {
        const double place = column + (i + 0.5) / across;
        all &= tap(line.x(place) - 0.5, line.y(place) - 0.5, taps_.empty());
      }
    }
    if (!all) return blend(A(across * down), to);
    if (across * down > 1)
      for (int b = 0; b < bands_; ++b) sums_[static_cast<std::size_t>(b)] *= A(1) / A(across * down);
    store_.all(sums_.data(), 1, to);
    return true;
  }

  /// Whether a texel of the target does, or cannot tell.
  bool holds_data(const T* texel, const std::uint8_t* valid) const {
    if (valid && !*valid) return false;
    if (type_.alpha && !(texel[type_.data_bands()] > T{})) return false;
    return std::any_of(texel, texel + type_.data_bands(), [&](T sample) { return validity_below_.sample(sample); });
  }

  const S* texel(std::int32_t x, std::int32_t y, Holds& holds) const {
    const std::ptrdiff_t offset = sample_offset(x, y);
    holds = held_.all() ? Holds::All : held_.texels()[offset / bands_];
    return samples_ + offset;
  }

  /// `floor(place)` and the next, both within the raster.
  static std::array<std::int32_t, 2> neighbours(double place, std::int32_t size) {
    const double last = size - 1;
    return {static_cast<std::int32_t>(std::clamp(std::floor(place), 0.0, last)),
            static_cast<std::int32_t>(std::clamp(std::floor(place) + 1, 0.0, last))};
  }

  /// Notes the four texels around a place, and sums their bilinear sample; whether they hold all.
  bool tap(double x, double y, bool first) {
    const auto columns = neighbours(x, width_), rows = neighbours(y, height_);
    const A right = static_cast<A>(x - std::floor(x)), below = static_cast<A>(y - std::floor(y));
    std::array<Tap, 4> taps;
    Holds least = Holds::All;
    for (std::size_t n = 0; n < 4; ++n) {
      const bool is_right = n % 2, is_below = n / 2;
      taps[n].texel = texel(columns[is_right], rows[is_below], taps[n].holds);
      taps[n].weight = (is_right ? right : 1 - right) * (is_below ? below : 1 - below);
      least = std::min(least, taps[n].holds);
    }
    taps_.insert(taps_.end(), taps.begin(), taps.end());
    for (int b = 0; b < bands_; ++b) {
      const A value =
          bilinear(taps[0].texel + b, taps[1].texel + b, taps[2].texel + b, taps[3].texel + b, right, below);
      A& to = sums_[static_cast<std::size_t>(b)];
      to = first ? value : to + value;
    }
    return least == Holds::All;
  }

  /// Mean of those taps that hold data, by weight and opacity, where they are half of the `full` weight.
  bool blend(A full, T* to) {
    const int data_bands = type_.data_bands();
    A covered = 0, opacity = 0;
    for (const Tap& tap : taps_) {
      if (tap.holds == Holds::Nothing) continue;
      covered += tap.weight;
      if (type_.alpha) opacity += tap.weight * static_cast<A>(tap.texel[data_bands]);
    }
    if (covered < full / 2) return false;

    bool any = false;
    for (int b = 0; b < data_bands; ++b) {
      A weight = 0, opaque_weight = 0, sum = 0;
      for (const Tap& tap : taps_) {
        if (tap.holds == Holds::Nothing || !validity_.sample(tap.texel[b])) continue;
        const A opaque = type_.alpha ? tap.weight * static_cast<A>(tap.texel[data_bands]) : tap.weight;
        weight += tap.weight;
        opaque_weight += opaque;
        sum += opaque * static_cast<A>(tap.texel[b]);
      }
      const bool holds = weight >= full / 2;
      blended_[static_cast<std::size_t>(b)] = holds ? store_.data(sum / opaque_weight) : store_.hole();
      any |= holds;
    }
    if (!any) return false;
    std::copy_n(blended_.data(), data_bands, to);
    if (type_.alpha) to[data_bands] = nearest_sample<T>(opacity / covered);
    return true;
  }

  bool nearest(double x, double y, T* to) const {
    Holds holds;
    const S* from = texel(static_cast<std::int32_t>(x), static_cast<std::int32_t>(y), holds);
    if (holds == Holds::Nothing) return false;
    if constexpr (!Power) std::copy_n(from, bands_, to);
    return true;
  }

  /// False where not all of the sixteen texels hold all: its negative weights are for whole neighbourhoods.
  bool cubic(double x, double y, T* to) {
    const double left = std::floor(x), top = std::floor(y);
    const auto across = cubic_weights(static_cast<A>(x - left)), down = cubic_weights(static_cast<A>(y - top));
    std::array<const S*, 16> texels;
    for (std::size_t n = 0; n < 16; ++n) {
      Holds holds;
      const auto clamped = [](double place, std::int32_t size) {
        return static_cast<std::int32_t>(std::clamp<double>(place, 0, size - 1));
      };
      texels[n] = texel(clamped(left - 1 + static_cast<double>(n % 4), width_),
                        clamped(top - 1 + static_cast<double>(n / 4), height_), holds);
      if (holds != Holds::All) return false;
    }
    for (int b = 0; b < bands_; ++b) {
      A value = 0;
      for (std::size_t r = 0; r < 4; ++r) {
        A line = 0;
        for (std::size_t c = 0; c < 4; ++c) line += across[c] * static_cast<A>(texels[4 * r + c][b]);
        value += down[r] * line;
      }
      if (Power && !(value > 0)) return false;  // no power is negative
      sums_[static_cast<std::size_t>(b)] = value;
    }
    store_.all(sums_.data(), 1, to);
    return true;
  }

  const TexelType& type_;
  const Interpolation interpolation_;
  const int bands_;
  const std::int32_t width_, height_;
  const S* const samples_;  // of the source's window
  const Window window_;
  const std::ptrdiff_t row_;
  const Held& held_;
  const Validity<S> validity_;
  const Validity<T> validity_below_;
  const Store<T, A> store_;
  Block& target_;
  Places<A> places_;
  std::vector<A> sums_;
  std::vector<T> blended_;
  std::vector<Tap> taps_;
};

/// Decibels within any that were ever measured, so that their power is finite and not 0.
double power_of(double decibels) { return std::pow(10, std::clamp(decibels, -3000.0, 3000.0) / 10); }

/// Power of the data bands, and opacity as it is; NaN where there is no data.
template <class T>
void read_power(const Resampling& resampling, const Block& source, std::vector<double>& power) {
  const TexelType& type = resampling.type;
  const Validity<T> validity(type);
  const T* samples = reinterpret_cast<const T*>(source.row(source.window().y));
  power.resize(source.texels() * static_cast<std::size_t>(type.bands));
  for (std::size_t i = 0; i < power.size(); ++i) {
    const T sample = samples[i];
    const bool is_alpha = type.alpha && static_cast<int>(i % static_cast<std::size_t>(type.bands)) == type.bands - 1;
    power[i] = is_alpha ? static_cast<double>(sample)
               : validity.sample(sample)
                   ? power_of(static_cast<double>(sample) * resampling.options.scale + resampling.options.offset)
                   : std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace

void resample(const Resampling& resampling, std::span<const Patch> patches, const Window& clip, const Block& source,
              Block& target) {
  static thread_local Held held;
  held.read(resampling.type, source);
  const auto lay_all = [&](auto kernel) {
    for (const Patch& patch : patches) kernel.lay(patch, clip);
  };
  tiff::with_sample(resampling.type.sample, [&](auto sample) {
    using T = decltype(sample);
    using A = std::conditional_t<std::is_integral_v<T> && sizeof(T) <= 2, float, double>;
    if (resampling.options.power && resampling.options.interpolation != Interpolation::Nearest) {
      static thread_local std::vector<double> power;
      read_power<T>(resampling, source, power);
      lay_all(Kernel<true, double, T, double>(resampling, power.data(), source.window(), held, target));
    } else {
      const T* samples = reinterpret_cast<const T*>(source.row(source.window().y));
      lay_all(Kernel<false, T, T, A>(resampling, samples, source.window(), held, target));
    }
  });
}

void copy(const TexelType& type, std::array<std::int64_t, 2> shift, const Window& clip, const Block& source,
          Block& target) {
  static thread_local Held held;
  held.read(type, source);
  const Window& from = source.window();
  for (std::int32_t y = clip.y; y < clip.y + clip.height; ++y) {
    const auto row = static_cast<std::int32_t>(y - shift[1]), column = static_cast<std::int32_t>(clip.x - shift[0]);
    const std::size_t first = static_cast<std::size_t>(column - from.x), bytes = type.texel_bytes();
    const Holds* holds =
        held.all()
            ? nullptr
            : held.texels() + static_cast<std::size_t>(row - from.y) * static_cast<std::size_t>(from.width) + first;
    const std::byte* texels = source.row(row) + first * bytes;
    const std::size_t offset = static_cast<std::size_t>(clip.x - target.window().x);
    std::byte* to = target.row(y) + offset * bytes;
    std::uint8_t* valid = target.masked() ? target.valid_row(y) + offset : nullptr;
    // Stretches of texels that hold data
    const auto width = static_cast<std::size_t>(clip.width);
    for (std::size_t x = 0; x < width;) {
      std::size_t end = x;
      while (end < width && (!holds || holds[end] != Holds::Nothing)) end = holds ? end + 1 : width;
      std::memcpy(to + x * bytes, texels + x * bytes, (end - x) * bytes);
      if (valid) std::fill(valid + x, valid + end, std::uint8_t{255});
      x = std::max(end, x + 1);
    }
  }
}

}  // namespace nadir::mosaic

#include "nadir/render/expected_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace nadir::render {
namespace {

using std::numbers::pi;

constexpr int most_octaves = 32;
constexpr int steps = 6;              // of frequency across an octave's square
constexpr int octaves_above = 4;      // finer than the footprint: the reference passes 1/64 of their power
constexpr double least_share = 1e-9;  // of power: nothing

double square(double x) { return x * x; }
double sinc(double x) { return x == 0 ? 1 : std::sin(pi * x) / (pi * x); }

/// Mean of `n` samples evenly spread over a footprint of `phase` cycles.
double mean_of_samples(int n, double phase) {
  const double each = std::sin(pi * phase / n);
  return std::abs(each) < 1e-9 ? 1 : std::sin(pi * phase) / (n * each);
}

/// What halving by Lanczos leaves of a frequency, cycles a texel of the finer level.
double halving(double frequency) {
  constexpr int taps = 6;  // to each side
  static const std::array<double, taps> weights = [] {
    std::array<double, taps> w{};
    double sum = 0;
    for (int i = 0; i < taps; ++i) {
      const double x = (i + 0.5) / 2;
      w[static_cast<std::size_t>(i)] = sinc(x) * sinc(x / 3);
      sum += 2 * w[static_cast<std::size_t>(i)];
    }
    for (double& one : w) one /= sum;
    return w;
  }();
  double response = 0;
  for (int i = 0; i < taps; ++i)
    response += 2 * weights[static_cast<std::size_t>(i)] * std::cos(2 * pi * frequency * (i + 0.5));
  return response;
}

/// What level `level` shows of a frequency of level 0, before it is sampled.
double level_response(int level, double frequency) {
  double response = 1;
  for (int k = 0; k < level; ++k) response *= halving(std::ldexp(frequency, k));
  return response;
}

/// Transfer function of Keys' cubic convolution with a = -1/2.
double cubic_response(double f) {
  if (std::abs(f) < 1e-3) return 1;
  const double w = 2 * pi * f, a = -0.5;
  return 12 / (w * w) * (square(sinc(f)) - sinc(2 * f)) +
         a * 8 / (w * w) * (3 * square(sinc(2 * f)) - 2 * sinc(2 * f) - sinc(4 * f));
}
double interpolation(bool cubic, double f) { return cubic ? cubic_response(f) : square(sinc(f)); }

/// One axis of a way of sampling, at one frequency and its images, in the order of `orders`: the amplitudes that
/// arrive, and those of the reference, which reconstructs level 0 and has images too.
struct Axis {
  std::array<double, 5> amplitudes{}, reference{};
};
constexpr std::array<int, 5> orders = {0, -1, 1, -2, 2};

Axis axis_at(double frequency, double footprint, int samples, int level, bool cubic) {
  Axis axis;
  const double passed = level_response(level, frequency), texel = std::ldexp(1.0, level);
  for (std::size_t i = 0; i < orders.size(); ++i) {
    const double image = frequency + orders[i] / texel;
    axis.amplitudes[i] = passed * interpolation(cubic, image * texel) * mean_of_samples(samples, image * footprint);
    const double at = frequency + orders[i];
    axis.reference[i] = square(sinc(at)) * sinc(at * footprint);
  }
  return axis;
}

/// Mean square of the images of a wave of unit power: of level 0 less the reference's, which fall on them.
double images(const Axis& x, const Axis& y, double weight, bool shared) {
  double sum = 0;
  for (std::size_t j = 0; j < orders.size(); ++j)
    for (std::size_t i = j == 0 ? 1 : 0; i < orders.size(); ++i)
      sum += square(weight * x.amplitudes[i] * y.amplitudes[j] - (shared ? x.reference[i] * y.reference[j] : 0));
  return sum;
}

/// The frequency of place `i` of an axis in an octave, of which there are `steps`.
double frequency_at(int octave, int i) { return std::ldexp(1.0, -(octave + 1)) * (i + 0.5) / steps; }

/// Mean of `f(i, j)` over the power in an octave, the ring between two squares of places: within it power falls with
/// the square of the frequency, as between octaves of imagery.
template <class F>
double mean_over_ring(F&& f) {
  double sum = 0, power = 0;
  for (int j = 0; j < steps; ++j)
    for (int i = 0; i < steps; ++i) {
      if (2 * i < steps && 2 * j < steps) continue;
      const double weight = 1 / (square(i + 0.5) + square(j + 0.5));
      sum += weight * f(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
      power += weight;
    }
  return sum / power;
}

/// At all places of an axis in an octave.
using Axes = std::array<Axis, steps>;
Axes axes_in(int octave, double footprint, int samples, int level, bool cubic) {
  Axes axes;
  for (int i = 0; i < steps; ++i)
    axes[static_cast<std::size_t>(i)] = axis_at(frequency_at(octave, i), footprint, samples, level, cubic);
  return axes;
}

}  // namespace

namespace {

/// What of an octave's power a level loses whose parent stands for it. Beyond these octaves it is below 1e-5.
class LostShares {
 public:
  double operator()(int level, int octave) const {
    const int d = octave - level;
    if (d < -coarser_levels || d >= octaves) return 0;
    return shares_[static_cast<std::size_t>(std::min(level, coarser_levels))]
                  [static_cast<std::size_t>(d + coarser_levels)];
  }
  static const LostShares& get() {
    static const LostShares shares;
    return shares;
  }

 private:
  // Three halvings away from level 0, what came before has no part in the octaves that are left
  static constexpr int coarser_levels = 3, octaves = 5;

  LostShares() {
    for (int level = 0; level <= coarser_levels; ++level)
      for (int octave = 0; octave < level + octaves; ++octave)
        shares_[static_cast<std::size_t>(level)][static_cast<std::size_t>(octave - level + coarser_levels)] =
            share(level, octave);
  }

  static double share(int level, int octave) {
    std::array<double, steps> held, parent;
    for (int i = 0; i < steps; ++i) {
      const double f = frequency_at(octave, i), texel = std::ldexp(1.0, level);
      held[static_cast<std::size_t>(i)] = level_response(level, f);
      // A parent stands for its four texels: a box of two texels
      parent[static_cast<std::size_t>(i)] = halving(f * texel) * sinc(2 * f * texel);
    }
    return mean_over_ring(
        [&](std::size_t i, std::size_t j) { return square(held[i] * held[j] * (1 - parent[i] * parent[j])); });
  }
  std::array<std::array<double, coarser_levels + octaves>, coarser_levels + 1> shares_{};
};

}  // namespace

std::vector<double> ErrorModel::octave_powers(std::span<const double> losses) {
  const int n = static_cast<int>(std::min<std::size_t>(losses.size(), most_octaves));
  const LostShares& lost = LostShares::get();
  // Non-negative, by multiplying: the steps of Richardson and Lucy
  std::vector<double> powers(static_cast<std::size_t>(n));
  for (std::size_t i = 0; i < powers.size(); ++i) powers[i] = square(losses[i]);
  for (int turn = 0; turn < 60; ++turn) {
    std::vector<double> factor(powers.size(), 0), weight(powers.size(), 0);
    for (int k = 0; k < n; ++k) {
      double predicted = 0;
      for (int i = 0; i < n; ++i) predicted += lost(k, i) * powers[static_cast<std::size_t>(i)];
      const double ratio = predicted > 0 ? square(losses[static_cast<std::size_t>(k)]) / predicted : 1;
      for (int i = 0; i < n; ++i) {
        factor[static_cast<std::size_t>(i)] += lost(k, i) * ratio;
        weight[static_cast<std::size_t>(i)] += lost(k, i);
      }
    }
    for (std::size_t i = 0; i < powers.size(); ++i)
      if (weight[i] > 0) powers[i] *= factor[i] / weight[i];
  }
  return powers;
}

std::vector<double> ErrorModel::shares(const SampledFootprint& f) const {
  std::vector<double> result(most_octaves, 0.0);
  const double shorter = std::max(std::min(f.width, f.height), 1.0);
  const int first = std::max(0, static_cast<int>(std::floor(std::log2(shorter))) - octaves_above);
  for (int octave = first; octave < most_octaves; ++octave) {
    const Axes x = axes_in(octave, f.width, f.samples_x, f.level, f.cubic),
               y = axes_in(octave, f.height, f.samples_y, f.level, f.cubic);
    Axes cx{}, cy{};  // of the coarser level
    if (f.coarser > 0) {
      cx = axes_in(octave, f.width, f.samples_x, f.level + 1, f.cubic);
      cy = axes_in(octave, f.height, f.samples_y, f.level + 1, f.cubic);
    }
    const double share = mean_over_ring([&](std::size_t i, std::size_t j) {
      double arrived = (1 - f.coarser) * x[i].amplitudes[0] * y[j].amplitudes[0];
      double error = images(x[i], y[j], 1 - f.coarser, f.level == 0);
      if (f.coarser > 0) {
        // Of the coarser level's images every second one falls on the finer one's; they are taken as others
        arrived += f.coarser * cx[i].amplitudes[0] * cy[j].amplitudes[0];
        error += images(cx[i], cy[j], f.coarser, false);
      }
      return error + square(arrived - x[i].reference[0] * y[j].reference[0]);
    });
    result[static_cast<std::size_t>(octave)] = share;
    if (octave > f.level + 3 && share < least_share) break;
  }
  return result;
}

double ErrorModel::mean_square_error(std::span<const double> octave_powers, const SampledFootprint& footprint) {
  constexpr double grain = 4;
  const auto rounded = [](double x) { return static_cast<int>(std::lround(grain * std::log2(std::max(x, 1e-6)))); };
  const Key key{rounded(footprint.width), rounded(footprint.height),
                footprint.samples_x,      footprint.samples_y,
                footprint.level,          static_cast<int>(std::lround(grain * footprint.coarser)),
                footprint.cubic};
  std::scoped_lock lock(mutex_);
  auto at = known_.find(key);
  if (at == known_.end()) {
    constexpr std::size_t most_known = 4096;
    if (known_.size() >= most_known) known_.clear();
    SampledFootprint there = footprint;
    there.width = std::exp2(std::get<0>(key) / grain);
    there.height = std::exp2(std::get<1>(key) / grain);
    there.coarser = std::get<5>(key) / grain;
    at = known_.emplace(key, shares(there)).first;
  }
  double sum = 0;
  for (std::size_t k = 0; k < octave_powers.size() && k < at->second.size(); ++k)
    sum += octave_powers[k] * at->second[k];
  return sum;
}

}  // namespace nadir::render

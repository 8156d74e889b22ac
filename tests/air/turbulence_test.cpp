#include "nadir/sim/turbulence.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace nadir::sim {
namespace {
using Eigen::Vector3d, std::numbers::pi;

constexpr double foot_m = 0.3048, knot_mps = 1852.0 / 3600;
constexpr double span_m = 2.8956;
const Passage passage{.speed_mps = 25, .height_above_ground_m = 60};
const double wind_mps = wind_at_20ft_mps(TurbulenceIntensity::Moderate);

Turbulence turbulence(const std::string& stream = "t") { return {wind_mps, span_m, RandomStream(11, stream)}; }

/// Series of the six components: forward, right, down, p, q, r.
using Series = std::array<std::vector<double>, 6>;
Series flown(int samples, double step_s, const std::string& stream = "t") {
  Turbulence air = turbulence(stream);
  Series out;
  TurbulenceSample s = air.start(passage);
  for (int k = 0; k < samples; ++k) {
    for (int i = 0; i < 3; ++i) {
      out[static_cast<std::size_t>(i)].push_back(s.velocity_mps[i]);
      out[static_cast<std::size_t>(i + 3)].push_back(s.rates_radps[i]);
    }
    s = air.advance(passage, step_s);
  }
  return out;
}

/// One-sided spectral density over angular frequency, as MIL-F-8785C prints it.
using Psd = std::function<double(double radps)>;
std::array<Psd, 6> printed_spectra(const TurbulenceScales& s) {
  const double v = passage.speed_mps, b = span_m;
  const auto transverse = [v](double sigma, double length) -> Psd {
    return [=](double w) {
      const double x2 = std::pow(length * w / v, 2);
      return sigma * sigma * length / (pi * v) * (1 + 3 * x2) / ((1 + x2) * (1 + x2));
    };
  };
  const Psd right = transverse(s.sigma_mps.y(), s.length_m.y()), down = transverse(s.sigma_mps.z(), s.length_m.z());
  const double su = s.sigma_mps.x(), lu = s.length_m.x(), sw = s.sigma_mps.z(), lw = s.length_m.z();
  return {[=](double w) { return su * su * 2 * lu / (pi * v) / (1 + std::pow(lu * w / v, 2)); },
          right,
          down,
          [=](double w) {
            return sw * sw / (v * lw) * 0.8 * std::cbrt(pi * lw / (4 * b)) / (1 + std::pow(4 * b * w / (pi * v), 2));
          },
          [=](double w) { return std::pow(w / v, 2) / (1 + std::pow(4 * b * w / (pi * v), 2)) * down(w); },
          [=](double w) { return std::pow(w / v, 2) / (1 + std::pow(3 * b * w / (pi * v), 2)) * right(w); }};
}

constexpr int segment = 512, segments = 4096;
constexpr double spectrum_step_s = 0.02;

/// Mean density over segments with a Hann window at a whole number of turns in a segment.
double measured_psd(const std::vector<double>& x, int turns) {
  double sum = 0, window2 = 0;
  std::vector<std::complex<double>> wave(segment);
  for (int k = 0; k < segment; ++k) {
    const double window = 0.5 - 0.5 * std::cos(2 * pi * k / segment);
    window2 += window * window;
    wave[static_cast<std::size_t>(k)] = window * std::polar(1.0, -2 * pi * turns * k / segment);
  }
  for (int m = 0; m < segments; ++m) {
    std::complex<double> z = 0;
    for (int k = 0; k < segment; ++k)
      z += x[static_cast<std::size_t>(m * segment + k)] * wave[static_cast<std::size_t>(k)];
    sum += std::norm(z);
  }
  return sum / segments / window2 * spectrum_step_s / pi;
}

/// What that estimates of a density: with all that lies a sampling frequency off folded in, and smeared as the window
/// does: its power falls on the bins -1, 0, 1 as 1/6, 2/3, 1/6.
double expected_psd(const Psd& psd, int turns) {
  const auto sampled = [&](double bin) {
    double sum = 0;
    const double sampling_radps = 2 * pi / spectrum_step_s, w = sampling_radps * bin / segment;
    for (int fold = -40; fold <= 40; ++fold) sum += psd(std::abs(w + fold * sampling_radps));
    return sum;
  };
  return sampled(turns - 1) / 6 + sampled(turns) * 2 / 3 + sampled(turns + 1) / 6;
}

TEST(DrydenTurbulence, HasTheSpectraOfTheStandard) {
  // A periodogram's ordinate has its own mean as standard deviation; of 4096 segments (in pairs of neighbours slightly
  // alike), 1/64 of it. Five of those, and 1 % for the window's smearing of curved spectra and folds beyond 40.
  constexpr double bound = 5.0 / 64 + 0.01;
  const Series series = flown(segment * segments, spectrum_step_s);
  const auto printed = printed_spectra(turbulence_scales(passage.height_above_ground_m, wind_mps));
  TurbulenceScales wrong = turbulence_scales(passage.height_above_ground_m, wind_mps);
  wrong.length_m *= 1.2;
  const auto longer = printed_spectra(wrong);
  for (std::size_t i = 0; i < 6; ++i) {
    double worst = 0, worst_of_longer = 0;
    for (const int turns : {2, 3, 5, 8, 13, 21, 34, 55, 89, 144}) {  // 0.2 to 14 Hz
      const double found = measured_psd(series[i], turns);
      const double ratio = found / expected_psd(printed[i], turns);
      EXPECT_NEAR(ratio, 1, bound) << "component " << i << ", bin " << turns;
      worst = std::max(worst, std::abs(ratio - 1));
      worst_of_longer = std::max(worst_of_longer, std::abs(found / expected_psd(longer[i], turns) - 1));
    }
    RecordProperty("worst_" + std::to_string(i), std::to_string(worst));
    EXPECT_GT(worst_of_longer, bound) << "component " << i << ": a scale 1.2 times as long would not be found";
  }
}

double mean_square(const std::vector<double>& x) {
  double sum = 0;
  for (const double v : x) sum += v * v;
  return sum / static_cast<double>(x.size());
}

TEST(DrydenTurbulence, HasItsVarianceWhateverTheStep) {
  // A time T of a process with correlation e^(-t/t0) estimates its variance within sqrt(2 t0/T); t0 is under L/V, and a
  // little more for the transverse ones. 5 standard deviations.
  const TurbulenceScales s = turbulence_scales(passage.height_above_ground_m, wind_mps);
  for (const double step_s : {0.0025, 0.01, 0.1, 1.0, 20.0}) {
    const int samples = 400'000;
    const Series series = flown(samples, step_s, std::to_string(step_s));
    for (int i = 0; i < 3; ++i) {
      const double t0 = std::max(s.length_m[i] / passage.speed_mps, step_s / 2);
      EXPECT_NEAR(mean_square(series[static_cast<std::size_t>(i)]) / std::pow(s.sigma_mps[i], 2), 1,
                  5 * std::sqrt(2 * t0 / (samples * step_s)))
          << "component " << i << ", step " << step_s;
    }
    // Roll's: the printed density integrates to pi/2 times its value at 0 times its corner.
    const double p2 = 0.8 * std::cbrt(pi * s.length_m.z() / (4 * span_m)) * std::pow(s.sigma_mps.z(), 2) * pi * pi /
                      (8 * span_m * s.length_m.z());
    const double t0 = std::max(4 * span_m / (pi * passage.speed_mps), step_s / 2);
    EXPECT_NEAR(mean_square(series[3]) / p2, 1, 5 * std::sqrt(2 * t0 / (samples * step_s))) << step_s;
  }
}

TEST(DrydenTurbulence, CorrelatesOverADistanceAsItsSpectrumSaysWhateverTheStep) {
  // The correlations of Dryden's spectra: e^(-x/L) along, (1 - x / 2L) e^(-x/L) across. Over 12.5 m, in one step or in
  // 50. 30,000 seconds: each product's mean is known to sqrt(2 t0/T) of the variance; 5 of those.
  const TurbulenceScales s = turbulence_scales(passage.height_above_ground_m, wind_mps);
  const double duration_s = 30'000, lag_s = 0.5, x_m = lag_s * passage.speed_mps;
  for (const int steps : {1, 5, 50}) {
    const double step_s = lag_s / steps;
    const Series series = flown(static_cast<int>(duration_s / step_s), step_s, std::to_string(steps));
    for (int i = 0; i < 3; ++i) {
      const auto& v = series[static_cast<std::size_t>(i)];
      double sum = 0;
      std::size_t n = 0;
      for (std::size_t k = static_cast<std::size_t>(steps); k < v.size(); ++k, ++n)
        sum += v[k] * v[k - static_cast<std::size_t>(steps)];
      const double along = x_m / s.length_m[i];
      const double expected = std::exp(-along) * (i == 0 ? 1 : 1 - along / 2);
      EXPECT_NEAR(sum / static_cast<double>(n) / std::pow(s.sigma_mps[i], 2), expected,
                  5 * std::sqrt(2 * s.length_m[i] / passage.speed_mps / duration_s))
          << "component " << i << ", " << steps << " steps";
    }
  }
}

TEST(DrydenTurbulence, ManyStepsHaveTheTransitionOfOne) {
  // Without noise a state only decays: the same decay in 1 step and in 64, to rounding.
  for (const double rate : {1e-3, 0.05, 3.0})
    for (const double lag : {0.3, 3.0, 8.0})  // where they are equal there is no closed form
      for (const double span_s : {0.0025, 0.5, 4.0}) {
        TransverseGust once, often;
        once.start(rate, lag, {1.3, -0.4, 0.8});
        often = once;
        once.advance(rate, lag, span_s, Vector3d::Zero());
        for (int k = 0; k < 64; ++k) often.advance(rate, lag, span_s / 64, Vector3d::Zero());
        EXPECT_NEAR(once.value(), often.value(), 2e-14);
        EXPECT_NEAR(once.lagged(), often.lagged(), 2e-14);
      }
}

TEST(DrydenTurbulence, TurnsAsAirThatCarriesABodyWould) {
  // Air that turns at q moves its front up: w = -q x. The field passes at V, so that q = -(dw/dt) / V; likewise r =
  // (dv/dt) / V. Over long scales, where the span is nothing: differences over 0.2 s, of 12 spans' lag.
  const Series s = flown(200'000, 0.02);
  double q = 0, r = 0, w2 = 0, v2 = 0, q2 = 0, r2 = 0;
  for (std::size_t k = 10; k + 10 < s[0].size(); ++k) {
    const double dw = s[2][k + 5] - s[2][k - 5], dv = s[1][k + 5] - s[1][k - 5];
    q += s[4][k] * dw, r += s[5][k] * dv;
    w2 += dw * dw, v2 += dv * dv, q2 += s[4][k] * s[4][k], r2 += s[5][k] * s[5][k];
  }
  EXPECT_LT(q / std::sqrt(w2 * q2), -0.5);
  EXPECT_GT(r / std::sqrt(v2 * r2), 0.5);
}

TEST(DrydenTurbulence, ComponentsAreIndependent) {
  const Series s = flown(400'000, 0.1);
  for (const auto& [a, b] : {std::pair<std::size_t, std::size_t>{0, 1}, {0, 2}, {1, 2}, {0, 3}, {2, 3}}) {
    double sum = 0;
    for (std::size_t k = 0; k < s[a].size(); ++k) sum += s[a][k] * s[b][k];
    // Correlation times of both are under 6 s: 40,000 s hold 6,000 independent pairs.
    EXPECT_NEAR(sum / static_cast<double>(s[a].size()) / std::sqrt(mean_square(s[a]) * mean_square(s[b])), 0,
                5 / std::sqrt(6000.0))
        << a << " and " << b;
  }
}

TEST(DrydenTurbulence, IsTheSameBytesInAnyOrderOfVehicles) {
  Turbulence a = turbulence("a"), b = turbulence("b"), again = turbulence("a");
  std::vector<Vector3d> seen = {a.start(passage).velocity_mps};
  b.start(passage);
  for (int k = 0; k < 100; ++k) {
    b.advance(passage, 0.01);
    seen.push_back(a.advance(passage, 0.01).velocity_mps);
  }
  std::vector<Vector3d> alone = {again.start(passage).velocity_mps};
  for (int k = 0; k < 100; ++k) alone.push_back(again.advance(passage, 0.01).velocity_mps);
  EXPECT_EQ(alone, seen);
  EXPECT_NE(b.advance(passage, 0.01).velocity_mps, again.advance(passage, 0.01).velocity_mps);
}

TEST(TurbulenceScalesOfTheStandard, NearTheGroundFollowHeightAndWind) {
  // By hand from the formulas of section 3.7. At 200 ft 0.177 + 0.000823 h = 0.3416: L_u = 200 / 0.3416^1.2 = 725.8 ft,
  // and sigma_u / sigma_w = 1 / 0.3416^0.4 = 1.5367.
  const TurbulenceScales s = turbulence_scales(200 * foot_m, 30 * knot_mps);
  EXPECT_NEAR(s.length_m.z() / foot_m, 200, 1e-9);
  EXPECT_NEAR(s.length_m.x() / foot_m, 725.8, 0.05);
  EXPECT_EQ(s.length_m.x(), s.length_m.y());
  EXPECT_NEAR(s.sigma_mps.z(), 3 * knot_mps, 1e-12);
  EXPECT_NEAR(s.sigma_mps.x() / s.sigma_mps.z(), 1.5367, 0.5e-4);
  EXPECT_EQ(s.sigma_mps.x(), s.sigma_mps.y());
  // At 1000 ft the ratio is 1: as in all directions.
  const TurbulenceScales top = turbulence_scales(1000 * foot_m, 30 * knot_mps);
  EXPECT_NEAR(top.length_m.x() / foot_m, 1000, 1e-9);
  EXPECT_NEAR(top.sigma_mps.x(), top.sigma_mps.z(), 1e-12);
  EXPECT_EQ(turbulence_scales(0, 10).length_m, turbulence_scales(10 * foot_m, 10).length_m);
}

TEST(TurbulenceScalesOfTheStandard, BelowTenFeetGroundStopsWindUpAndDown) {
  const TurbulenceScales ten = turbulence_scales(10 * foot_m, 10), low = turbulence_scales(1.25 * foot_m, 10);
  EXPECT_NEAR(ten.sigma_mps.z(), 1, 1e-12);
  EXPECT_NEAR(low.sigma_mps.z(), 0.5, 1e-12);
  EXPECT_EQ(low.sigma_mps.head<2>(), ten.sigma_mps.head<2>());
  for (const double height_m : {0.0, -3.0}) EXPECT_EQ(turbulence_scales(height_m, 10).sigma_mps.z(), 0);
  EXPECT_LT(turbulence_scales(1e-9, 10).sigma_mps.z(), 1e-3);
  Turbulence on_ground(10, 3, RandomStream(1, "ground"));
  const TurbulenceSample sample = on_ground.start({1, 0});
  EXPECT_EQ(sample.velocity_mps.z(), 0);
  EXPECT_EQ(sample.rates_radps.head<2>(), Eigen::Vector2d::Zero());
  EXPECT_NE(sample.rates_radps.z(), 0);
}

TEST(TurbulenceScalesOfTheStandard, HighUpFollowTheFigureOfExceedance) {
  using enum TurbulenceIntensity;
  struct Row {
    double height_ft;
    TurbulenceIntensity intensity;
    double sigma_ftps;
  };
  for (const Row& row :
       {Row{3750, Light, 7.4}, Row{3750, Moderate, 10.6}, Row{3750, Severe, 23.0}, Row{15000, Light, 4.6},
        Row{20000, Moderate, 7.3}, Row{55000, Light, 0}, Row{80000, Severe, 5.1}, Row{99000, Severe, 5.1}}) {
    const TurbulenceScales s = turbulence_scales(row.height_ft * foot_m, wind_at_20ft_mps(row.intensity));
    EXPECT_NEAR(s.sigma_mps.x() / foot_m, row.sigma_ftps, 1e-9) << row.height_ft;
    EXPECT_EQ(s.sigma_mps.x(), s.sigma_mps.z());
    EXPECT_NEAR(s.length_m.y() / foot_m, 1750, 1e-9);
  }
}

TEST(TurbulenceScalesOfTheStandard, GoOnWithoutJumpsInHeightAndWind) {
  for (double h = 0.5; h < 30000; h += 7)
    for (const double wind : {3.0, 10.0, 20.0, 40.0}) {
      const TurbulenceScales a = turbulence_scales(h, wind), b = turbulence_scales(h + 0.01, wind);
      EXPECT_LT((a.sigma_mps - b.sigma_mps).norm(), 0.02) << h;
      EXPECT_LT((a.length_m - b.length_m).norm(), 0.2) << h;
    }
  for (double wind = 0; wind < 50; wind += 0.5)
    EXPECT_LE(turbulence_scales(3000, wind).sigma_mps.x(), turbulence_scales(3000, wind + 0.5).sigma_mps.x());
  EXPECT_EQ(turbulence_scales(3000, 0).sigma_mps, Vector3d(0, 0, 0));
}

}  // namespace
}  // namespace nadir::sim

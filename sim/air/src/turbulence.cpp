#include "nadir/sim/turbulence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "nadir/base/text.h"

namespace nadir::sim {
namespace {
using Eigen::Vector3d, std::numbers::pi;

constexpr double foot_m = 0.3048, knot_mps = 1852.0 / 3600;
constexpr std::array<std::string_view, 3> intensity_names = {"light", "moderate", "severe"};

/// MIL-F-8785C, figure 7: feet a second at heights in feet, of probability 1e-2, 1e-3 and 1e-5 to be exceeded.
constexpr std::array<double, 12> figure_ft = {500,   1750,  3750,  7500,  15000, 25000,
                                              35000, 45000, 55000, 65000, 75000, 80000};
constexpr std::array<std::array<double, 12>, 3> figure_ftps = {{
    {6.6, 6.9, 7.4, 6.7, 4.6, 2.7, 0.4, 0, 0, 0, 0, 0},
    {8.6, 9.6, 10.6, 10.1, 8.0, 6.6, 5.0, 4.2, 2.7, 0, 0, 0},
    {15.6, 17.6, 23.0, 23.6, 22.1, 20.0, 16.0, 15.1, 12.1, 7.9, 6.2, 5.1},
}};

/// Of one intensity in the figure; constant beyond its ends.
double figure_sigma_ftps(std::size_t intensity, double height_ft) {
  const auto& sigma = figure_ftps[intensity];
  if (height_ft <= figure_ft.front()) return sigma.front();
  for (std::size_t i = 1; i < figure_ft.size(); ++i)
    if (height_ft < figure_ft[i])
      return sigma[i - 1] +
             (sigma[i] - sigma[i - 1]) * (height_ft - figure_ft[i - 1]) / (figure_ft[i] - figure_ft[i - 1]);
  return sigma.back();
}

double high_sigma_mps(double height_ft, double wind_mps) {
  const double units = wind_mps / (15 * knot_mps);  // light is 1, severe 3
  const double light = figure_sigma_ftps(0, height_ft), moderate = figure_sigma_ftps(1, height_ft),
               severe = figure_sigma_ftps(2, height_ft);
  const double sigma_ftps = units <= 1   ? units * light
                            : units <= 2 ? light + (units - 1) * (moderate - light)
                            : units <= 3 ? moderate + (units - 2) * (severe - moderate)
                                         : severe * units / 3;
  return sigma_ftps * foot_m;
}

/// Of the standard, which begins at 10 ft. Below, lengths stay, and ground lets less air up and down.
TurbulenceScales low_scales(double above_ground_ft, double wind_mps) {
  constexpr double lowest_ft = 10;
  const double height_ft = std::max(lowest_ft, above_ground_ft);
  const double ratio = 0.177 + 0.000823 * height_ft;
  const double sigma_w = 0.1 * wind_mps, sigma_u = sigma_w / std::pow(ratio, 0.4);
  const double length_u_m = height_ft / std::pow(ratio, 1.2) * foot_m;
  const double blocked = std::cbrt(std::clamp(above_ground_ft / lowest_ft, 0.0, 1.0));
  return {{sigma_u, sigma_u, sigma_w * blocked}, {length_u_m, length_u_m, height_ft * foot_m}};
}

TurbulenceScales high_scales(double height_ft, double wind_mps) {
  return {Vector3d::Constant(high_sigma_mps(height_ft, wind_mps)), Vector3d::Constant(1750 * foot_m)};
}

/// A first-order process of unit variance after a step.
double advance_first_order(double now, double rate_radps, double step_s, double normal) {
  const double kept = -std::expm1(-2 * rate_radps * step_s);  // share of the variance that is new
  return std::exp(-rate_radps * step_s) * now + std::sqrt(kept) * normal;
}

// Output of the transverse process by its two states.
const double on_first = std::sqrt(3.0), on_second = 1 - std::sqrt(3.0);

/// Lower triangle L with L L^T = `m`, positive semidefinite: what rounding leaves below zero is zero.
Eigen::Matrix3d lower_root(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d l = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) {
      double rest = m(i, j);
      for (int k = 0; k < j; ++k) rest -= l(i, k) * l(j, k);
      if (i == j)
        l(i, i) = std::sqrt(std::max(rest, 0.0));
      else
        l(i, j) = l(j, j) > 0 ? rest / l(j, j) : 0;
    }
  return l;
}

/// e^(a t) by its series to the tenth order: with |a t| < 1/4 the rest is below 1e-14.
Eigen::Matrix3d exponential_near_zero(const Eigen::Matrix3d& at) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Identity();
  for (int n = 10; n > 0; --n) sum = Eigen::Matrix3d::Identity() + at * sum / n;
  return sum;
}

}  // namespace

std::string_view to_string(TurbulenceIntensity intensity) {
  return intensity_names[static_cast<std::size_t>(intensity)];
}
Result<TurbulenceIntensity> parse_turbulence_intensity(std::string_view name) {
  return parse_name<TurbulenceIntensity>("intensity of turbulence", name, intensity_names);
}
double wind_at_20ft_mps(TurbulenceIntensity intensity) { return 15 * knot_mps * (1 + static_cast<double>(intensity)); }

TurbulenceScales turbulence_scales(double height_above_ground_m, double wind_at_20ft_mps) {
  constexpr double low_ft = 1000, high_ft = 2000;
  const double height_ft = height_above_ground_m / foot_m;
  if (height_ft <= low_ft) return low_scales(height_ft, wind_at_20ft_mps);
  if (height_ft >= high_ft) return high_scales(height_ft, wind_at_20ft_mps);
  const TurbulenceScales low = low_scales(low_ft, wind_at_20ft_mps), high = high_scales(high_ft, wind_at_20ft_mps);
  const double share = (height_ft - low_ft) / (high_ft - low_ft);
  return {low.sigma_mps + share * (high.sigma_mps - low.sigma_mps),
          low.length_m + share * (high.length_m - low.length_m)};
}

// States: x' = -a x + sqrt(a) white, y' = a (x - y), m' = c (sqrt(3) x + (1 - sqrt(3)) y - m). The transfer from white
// noise to the process is then (1 + sqrt(3) s/a) / (1 + s/a)^2 / sqrt(a).
void TransverseGust::start(double rate_radps, double lag_radps, const Vector3d& normals) {
  // Stationary covariances: the solution of A P + P A^T + B B^T = 0
  const double a = rate_radps, c = lag_radps;
  const double xx = 0.5, xy = 0.25, yy = 0.25;
  const double xm = c / (a + c) * (on_first * xx + on_second * xy);
  const double ym = (a * xm + c * (on_first * xy + on_second * yy)) / (a + c);
  const double mm = on_first * xm + on_second * ym;
  Eigen::Matrix3d covariance;
  covariance << xx, xy, xm, xy, yy, ym, xm, ym, mm;
  state_ = lower_root(covariance) * normals;
}

TransverseGust::Step TransverseGust::exact(double rate_radps, double lag_radps, double step_s) {
  const double a = rate_radps, c = lag_radps;
  Eigen::Matrix3d change;
  change << -a, 0, 0, a, -a, 0, c * on_first, c * on_second, -c;

  // A short first step: its noise is the integral of e^(A s) B B^T e^(A^T s), by Gauss' rule with four nodes
  static constexpr std::array<std::pair<double, double>, 4> nodes = {{{0.06943184420297371, 0.17392742256872692},
                                                                      {0.33000947820757187, 0.32607257743127307},
                                                                      {0.66999052179242813, 0.32607257743127307},
                                                                      {0.93056815579702629, 0.17392742256872692}}};
  int doublings = 0;
  double first_s = step_s;
  for (; std::max(a, c) * first_s > 0.05; first_s /= 2) ++doublings;  // rows of `change` sum to under 3.5 times that
  Eigen::Matrix3d transition = exponential_near_zero(change * first_s);
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
  for (const auto& [place, weight] : nodes) {
    const Vector3d response = exponential_near_zero(change * (place * first_s)).col(0) * std::sqrt(a);
    noise += weight * first_s * response * response.transpose();
  }
  // Steps of twice the length: sums of positive terms, so that short steps lose no digits to differences
  for (int i = 0; i < doublings; ++i) {
    noise = (noise + transition * noise * transition.transpose()).eval();
    transition = (transition * transition).eval();
  }
  return {a, c, step_s, transition, lower_root(noise)};
}

void TransverseGust::advance(double rate_radps, double lag_radps, double step_s, const Vector3d& normals) {
  const auto differs = [](double now, double then) { return std::abs(now - then) > then / 256; };
  if (step_s != step_.step_s || differs(rate_radps, step_.rate_radps) || differs(lag_radps, step_.lag_radps))
    step_ = exact(rate_radps, lag_radps, step_s);
  state_ = (step_.transition * state_ + step_.noise * normals).eval();
}

double TransverseGust::value() const { return on_first * state_.x() + on_second * state_.y(); }

Turbulence::Turbulence(double wind_at_20ft_mps, double span_m, const RandomStream& stream)
    : wind_at_20ft_mps_(wind_at_20ft_mps), span_m_(span_m), stream_(stream) {}

TurbulenceSample Turbulence::start(const Passage& passage) {
  const TurbulenceScales scales = turbulence_scales(passage.height_above_ground_m, wind_at_20ft_mps_);
  const auto one = stream_.normals(0, 0), two = stream_.normals(0, 1);
  samples_ = 1;
  forward_ = one[0];
  roll_ = two[3];
  const Vector3d rate = passage.speed_mps * scales.length_m.cwiseInverse();
  right_.start(rate.y(), pi * passage.speed_mps / (3 * span_m_), {one[1], one[2], one[3]});
  down_.start(rate.z(), pi * passage.speed_mps / (4 * span_m_), {two[0], two[1], two[2]});
  return sample(scales);
}

TurbulenceSample Turbulence::advance(const Passage& passage, double step_s) {
  const TurbulenceScales scales = turbulence_scales(passage.height_above_ground_m, wind_at_20ft_mps_);
  const auto one = stream_.normals(samples_, 0), two = stream_.normals(samples_, 1);
  ++samples_;
  const Vector3d rate = passage.speed_mps * scales.length_m.cwiseInverse();
  const double lag_r = pi * passage.speed_mps / (3 * span_m_), lag_pq = pi * passage.speed_mps / (4 * span_m_);
  forward_ = advance_first_order(forward_, rate.x(), step_s, one[0]);
  roll_ = advance_first_order(roll_, lag_pq, step_s, two[3]);
  right_.advance(rate.y(), lag_r, step_s, {one[1], one[2], one[3]});
  down_.advance(rate.z(), lag_pq, step_s, {two[0], two[1], two[2]});
  return sample(scales);
}

TurbulenceSample Turbulence::sample(const TurbulenceScales& scales) const {
  TurbulenceSample out;
  const Vector3d& sigma = scales.sigma_mps;
  out.velocity_mps = {sigma.x() * forward_, sigma.y() * right_.value(), sigma.z() * down_.value()};
  // A lagged derivative: s/V behind a lag c is (1 - lag) c/V, and c/V is a length of the span.
  const double length_w_m = scales.length_m.z();
  const double sigma_p = sigma.z() * std::sqrt(0.8 * pi * pi / (8 * span_m_ * length_w_m)) *
                         std::pow(pi * length_w_m / (4 * span_m_), 1.0 / 6);
  out.rates_radps = {sigma_p * roll_, -sigma.z() * pi / (4 * span_m_) * (down_.value() - down_.lagged()),
                     sigma.y() * pi / (3 * span_m_) * (right_.value() - right_.lagged())};
  return out;
}

}  // namespace nadir::sim

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>

#include "nadir/base/random.h"
#include "nadir/base/result.h"

namespace nadir::sim {

/// How rough the air is, by the wind 20 ft above ground that makes it so: 15, 30 and 45 knots.
enum class TurbulenceIntensity { Light, Moderate, Severe };
std::string_view to_string(TurbulenceIntensity intensity);  // "moderate"
Result<TurbulenceIntensity> parse_turbulence_intensity(std::string_view name);
double wind_at_20ft_mps(TurbulenceIntensity intensity);

/// Root mean square and scale length of turbulence along its forward, right and down axes.
struct TurbulenceScales {
  Eigen::Vector3d sigma_mps;
  Eigen::Vector3d length_m;
};

/// At a height. Up to 1000 ft both follow height and the wind at 20 ft; from 2000 ft on lengths are 1750 ft, and
/// intensities those of probability 1e-2, 1e-3 and 1e-5 for light, moderate and severe, between them in proportion to
/// the wind at 20 ft, beyond 45 knots as severe in that proportion; between 1000 and 2000 ft linear in height. Under
/// 10 ft as at 10 ft, but for wind up and down, which falls off with the cube root of height to none on the ground.
/// Source: MIL-F-8785C, 1980, section 3.7 and figure 7; below 10 ft Hunt and Graham, Free-stream turbulence near plane
/// boundaries, 1978: a wall lets through of its normal component what eddies smaller than the distance carry.
TurbulenceScales turbulence_scales(double height_above_ground_m, double wind_at_20ft_mps);

/// How a vehicle passes through a field of turbulence.
struct Passage {
  double speed_mps = 0;  // through the air
  double height_above_ground_m = 0;
};

/// Wind and turning of the air along forward (the level direction of the way through the air), right and down.
struct TurbulenceSample {
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d rates_radps = Eigen::Vector3d::Zero();
};

/// A second-order process of unit variance with Dryden's spectrum of transverse wind, and that process behind a
/// first-order lag: exactly as they are after a step of any length, driven by three standard normal draws.
///
/// The spectrum of the process over angular frequency w, one-sided: (2 / (pi a)) / 2 (1 + 3 (w/a)^2) / (1 + (w/a)^2)^2.
class TransverseGust {
 public:
  /// From the stationary distribution. `rate_radps`: a, speed over scale length; `lag_radps`: of the lag. Both > 0.
  void start(double rate_radps, double lag_radps, const Eigen::Vector3d& normals);
  void advance(double rate_radps, double lag_radps, double step_s, const Eigen::Vector3d& normals);

  double value() const;
  double lagged() const { return state_.z(); }

 private:
  /// What a step does: transition of the state, and a lower triangle whose product with normal draws is its noise.
  struct Step {
    double rate_radps = 0, lag_radps = 0, step_s = 0;
    Eigen::Matrix3d transition, noise;
  };
  static Step exact(double rate_radps, double lag_radps, double step_s);

  Eigen::Vector3d state_ = Eigen::Vector3d::Zero();
  Step step_;
};

/// Dryden turbulence along one vehicle's flight: three components of wind and three of turning.
///
/// Each sample comes from the one before and from draws addressed by its number: evaluating other vehicles, or more or
/// fewer observations, changes nothing. Steps are exact for the process, so that sampling more often gives the same
/// spectrum. Coefficients follow the passage once it has changed them by 1/256.
/// Source: MIL-F-8785C, 1980, section 3.7: spectra of Dryden form. The lag of a span b filters the rates; the air's
/// turn q is that of a gradient of down wind along the way, -dw/dx, r is dv/dx, and p a process of its own.
class Turbulence {
 public:
  /// `span_m`: of the wing, or of the rotors; > 0.
  Turbulence(double wind_at_20ft_mps, double span_m, const RandomStream& stream);

  /// Sample 0, from the stationary distribution; the next one.
  TurbulenceSample start(const Passage& passage);
  TurbulenceSample advance(const Passage& passage, double step_s);

 private:
  TurbulenceSample sample(const TurbulenceScales& scales) const;

  double wind_at_20ft_mps_, span_m_;
  RandomStream stream_;
  std::uint64_t samples_ = 0;
  double forward_ = 0, roll_ = 0;  // of unit variance
  TransverseGust right_, down_;
};

}  // namespace nadir::sim

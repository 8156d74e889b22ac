#pragma once

#include <map>
#include <mutex>
#include <span>
#include <tuple>
#include <vector>

namespace nadir::render {

/// How pixels are sampled, as far as their error hangs on it.
struct SampledFootprint {
  double width = 1, height = 1;      // of the pixel's footprint along its two sides, level-0 texels
  int samples_x = 1, samples_y = 1;  // across them
  int level = 0;                     // of the finer level sampled
  double coarser = 0;                // weight of the next one, [0, 1]
  bool cubic = false;                // interpolation
};

/// Predicts the error of pixels from what their map loses from level to level, in the frequencies of the imagery.
///
/// Octave k of a map holds the frequencies between 2^-(k+2) and 2^-(k+1) cycles a texel: what level k shows and level
/// k + 1 cannot. Each way of sampling passes a share of an octave's power on that the reference (the mean over the
/// footprint) would not, or holds some back: the transfer functions of levels (Lanczos), of interpolation with its
/// images, and of the grid of samples are compared at places of each octave. Directions are taken as equal in power,
/// and footprints as rectangles along the map's axes. Error: bench/render/README.md shows predictions beside measured
/// errors. Source: of losses as wavelets' energies, Mallat, A theory for multiresolution signal decomposition, 1989; of
/// interpolation's images, Mitchell and Netravali, Reconstruction filters in computer graphics, 1988.
class ErrorModel {
 public:
  /// Power (mean square) in each octave, of a map whose level k loses `losses[k]` (root mean square) where level k + 1
  /// stands for it: not negative, and such that the losses follow as well as they can.
  static std::vector<double> octave_powers(std::span<const double> losses);

  /// Mean square error of pixels sampled so. Octaves beyond the last one that has a power are taken to have none.
  /// Thread-safe; what it computed it keeps, by footprints rounded to a quarter of an octave and shares of levels to a
  /// quarter.
  double mean_square_error(std::span<const double> octave_powers, const SampledFootprint& footprint);

 private:
  using Key = std::tuple<int, int, int, int, int, int, bool>;
  std::vector<double> shares(const SampledFootprint& footprint) const;
  std::mutex mutex_;
  std::map<Key, std::vector<double>> known_;
};

}  // namespace nadir::render

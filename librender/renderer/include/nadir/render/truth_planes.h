#pragma once

#include <vector>

#include "nadir/render/exact_chain.h"

namespace nadir::render {

/// What each pixel sees: width * height values each, rows from the top, of the pixel's centre; NaN where that sees no
/// ground.
struct TruthPlanes {
  TruthPlanes() = default;
  TruthPlanes(int width_px, int height_px);  // without ground

  int width = 0, height = 0;
  std::vector<double> longitude_deg, latitude_deg;  // WGS-84
  std::vector<float> height_m;                      // above the ellipsoid
  std::vector<float> range_m;                       // from the camera
  std::vector<float> incidence_deg;             // between the ray and the surface's normal: 0 looking straight at it
  std::vector<float> ground_sample_distance_m;  // side of a square of the area between the pixel's corners; NaN where
                                                // one of them sees no ground

  /// Bit by bit: NaN equals NaN.
  bool operator==(const TruthPlanes& other) const;
};

/// By the exact chain at every pixel, no approximation: about 2 microseconds each. `threads`: 0 for all the machine
/// has. Error: that of the chain, and of the types.
TruthPlanes truth_planes(const ExactChain& chain, int threads = 0);

}  // namespace nadir::render

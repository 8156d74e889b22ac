#pragma once

#include <vector>

#include "nadir/base/result.h"
#include "nadir/render/exact_chain.h"
#include "nadir/render/frame.h"

namespace nadir::render {

/// Greatest way in the image, in pixels, that what is seen goes while a row is exposed: over a grid of image points,
/// and along the motion in eighths of the exposure. Where a point sees no ground, of the direction that it looks in.
double motion_px(const Camera& camera, const CameraMotion& motion, const Shutter& shutter, const Surface& surface);

/// Times from the middle of the exposure of the instants that stand for it, each in the middle of its part, at most
/// `step_px` of motion apart.
Result<std::vector<double>> exposure_instants_s(const Shutter& shutter, double motion_px, double step_px);

/// An exposure as the mean of instants, and its middle.
struct MovingExposure {
  Exposure exposure;
  ExactChain middle;
  std::vector<ExactChain> instants;
};
/// Of a shutter that is not instant; instants at most `step_px` of motion apart.
Result<MovingExposure> moving_exposure(const Camera& camera, const CameraMotion& motion, const Shutter& shutter,
                                       const Surface& surface, double step_px);

/// The mean of a layer's images, pixel by pixel, of their valid pixels; valid where at least half of them are. Values
/// in decibel are averaged in power. Error: of each image its own rounding, and of float values the rounding of a sum
/// in single precision.
class MeanImage {
 public:
  MeanImage(const FrameLayer& layer, bool decibel);
  void add(const FrameLayer& layer);
  /// Into samples and validity.
  void write(FrameLayer& layer) const;

 private:
  bool decibel_;
  int images_ = 0;
  std::vector<float> sums_;  // integers: exact up to 2^24
  std::vector<std::uint16_t> valid_;
};

}  // namespace nadir::render

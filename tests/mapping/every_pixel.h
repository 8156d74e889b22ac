#pragma once

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "nadir/render/patches.h"

namespace nadir::render {

/// Greatest backward error at every pixel centre, and how many pixels each kind of patch has. What is said to see no
/// ground sees none.
struct Outcome {
  double worst_px = 0;
  std::array<std::int64_t, 5> pixels{};
};

inline Outcome check_every_pixel(const ExactChain& chain, const geodesy::Projection& projection,
                                 const PatchMapping& mapping) {
  Outcome outcome;
  for (const Patch& patch : mapping.patches) {
    outcome.pixels[static_cast<std::size_t>(patch.kind)] +=
        static_cast<std::int64_t>(patch.rect.width) * patch.rect.height;
    if (patch.kind == Patch::Kind::PerPixel || patch.kind == Patch::Kind::OffMap) continue;
    std::vector<Eigen::Vector2d> image;
    for (int y = 0; y < patch.rect.height; ++y)
      for (int x = 0; x < patch.rect.width; ++x) image.emplace_back(patch.rect.x + x + 0.5, patch.rect.y + y + 0.5);
    std::vector<Eigen::Vector2d> crs(image.size());
    chain.crs_from_image(projection, image, crs);
    for (std::size_t i = 0; i < image.size(); ++i) {
      if (patch.kind == Patch::Kind::NoGround) {
        EXPECT_FALSE(crs[i].allFinite()) << image[i].transpose();
        continue;
      }
      const Eigen::Vector2d offset = image[i] - patch.corner();
      const bool h = patch.kind == Patch::Kind::Homography;
      const Eigen::Vector2d value = h ? apply(patch.crs_from_image, offset) : patch.biquadratic(offset);
      const Eigen::Matrix2d slope = h ? jacobian(patch.crs_from_image, offset) : patch.biquadratic.jacobian(offset);
      const double error_px = (slope.inverse() * (crs[i] - patch.crs_origin - value)).norm();
      outcome.worst_px = std::max(outcome.worst_px, std::isfinite(error_px) ? error_px : 1e9);
    }
  }
  return outcome;
}

}  // namespace nadir::render

#pragma once

#include <array>
#include <span>

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// Frame after frame at 30 m/s and 10 Hz, 0.3 m a pixel, over a map of which the cache holds a part.
Case steady_flight(const RunOptions& options);

/// How much pictures change otherwise than by the ground's motion, along a smooth flight.
Case flicker(const RunOptions& options);

/// Mean square over pixels and bands of what a picture of bytes shows otherwise than the one before, whose content is
/// moved by `motion_px` (right and down) by Lanczos interpolation of 8 x 8 samples; away from the border.
double squares_of_change(std::span<const std::byte> before, std::span<const std::byte> now, int width, int height,
                         int bands, const std::array<double, 2>& motion_px);

}  // namespace nadir::bench

#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace nadir::pyramid {

/// Texels of a finer level that one coarser texel covers along one axis, and how much of each.
struct Cover {
  std::int32_t first = 0;
  int count = 0;
  std::array<double, 3> parts = {};  // whole numbers > 0, all in one unit; 1 and 1 where a size is halved exactly
};

/// One axis of two neighbouring levels, which span the same ground: the coarser one is half as long, rounded up.
struct Axis {
  std::int32_t fine = 1, coarse = 1;

  bool halved() const { return std::int64_t{fine} == 2 * std::int64_t{coarse}; }

  /// In units of 1 / coarse of a finer texel, texel i reaches from i (2 coarse - 1) to (i + 1) (2 coarse - 1) where the
  /// finer size is odd: over i units of texel 2i - 1, all of 2i, and coarse - 1 - i units of 2i + 1.
  Cover cover(std::int32_t i) const {
    if (halved()) return {2 * i, 2, {1, 1}};
    Cover c;
    c.first = std::max(2 * i - 1, 0);
    if (i > 0) c.parts[static_cast<std::size_t>(c.count++)] = i;
    c.parts[static_cast<std::size_t>(c.count++)] = coarse;
    if (i < coarse - 1) c.parts[static_cast<std::size_t>(c.count++)] = coarse - 1 - i;
    return c;
  }

  /// The finer texel that holds the centre of texel i; of two that touch there, the lower: (2i + 1) fine / (2 coarse)
  /// lies in [2i, 2i + 1].
  static std::int32_t centre(std::int32_t i) { return 2 * i; }

  /// The coarser texel in which the centre of the finer texel j lies; of two that touch there, the higher. With an odd
  /// size that centre, (2j + 1) coarse / (4 coarse - 2), has passed (j + 1) / 2 for odd j from coarse - 1 on.
  std::int32_t parent(std::int32_t j) const { return !halved() && j % 2 == 1 && j + 1 >= coarse ? j / 2 + 1 : j / 2; }
};

}  // namespace nadir::pyramid

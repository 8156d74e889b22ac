#pragma once

#include <cstdint>

namespace nadir::pyramid {

/// The coarser sample in which the centre of the finer sample `i` lies, along one axis of `fine` and `coarse` samples.
inline std::int32_t parent(std::int32_t fine, std::int32_t coarse, std::int32_t i) {
  return static_cast<std::int32_t>((2 * std::int64_t{i} + 1) * coarse / (2 * std::int64_t{fine}));
}

}  // namespace nadir::pyramid

#pragma once

#include <cstdint>
#include <vector>

#include "nadir/pyramid/build.h"

namespace nadir::pyramid {

/// The samples along one axis of the finer level that one sample of the coarser comes from.
struct Taps {
  std::int32_t first = 0;
  std::vector<double> weights;  // sum 1
};

/// Taps of the coarser level's samples from `begin` to `end`; both levels span the same ground.
std::vector<Taps> taps(Filter filter, std::int32_t fine, std::int32_t coarse, std::int32_t begin, std::int32_t end);

}  // namespace nadir::pyramid

#pragma once

#include "covered.h"

namespace nadir::pyramid {

/// Fills `coarse` by Filter::Box, Nearest or Mode, all of which look at covered texels alone.
void reduce_covered(const LevelPair& pair, const Block& fine, Block& coarse);

/// Fills `coarse` by Filter::Gaussian or Lanczos.
void reduce_by_kernel(const LevelPair& pair, const Block& fine, Block& coarse);

}  // namespace nadir::pyramid

#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// Simulated seconds a second: by scheme, by part, recorded, many at once, for a day.
Suite sim_suite();

}  // namespace nadir::bench

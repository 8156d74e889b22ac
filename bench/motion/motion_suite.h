#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// What an exposure costs: error against run time over the step between its poses, beside a still frame.
Suite motion_suite();

}  // namespace nadir::bench

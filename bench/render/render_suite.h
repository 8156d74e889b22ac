#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// Frames of Nadir beside those of its peers: error against run time.
Suite render_suite();

}  // namespace nadir::bench

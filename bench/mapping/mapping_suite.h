#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// What it costs to know where each pixel looks, within an error.
Suite mapping_suite();

}  // namespace nadir::bench

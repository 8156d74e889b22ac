#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// By which filter levels should be made: the error of frames rendered from them.
Suite levels_suite();

}  // namespace nadir::bench

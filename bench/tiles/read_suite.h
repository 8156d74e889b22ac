#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// How fast texels come from disk or network to the sampler's cells, beside the codecs' libraries and GDAL.
Suite read_suite();

}  // namespace nadir::bench

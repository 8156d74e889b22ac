#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// What it costs to make a pyramid, beside libvips, GDAL's COG driver, maketx and the codecs' libraries alone.
Suite build_suite();

}  // namespace nadir::bench

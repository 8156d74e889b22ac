#pragma once

#include <cpl_string.h>

#include "mosaic.h"
#include "nadir/base/result.h"
#include "nadir/pyramid/build.h"

namespace nadir::pyramid {

/// Creation options of GDAL's COG driver for the codec that `options` ask for; fails where it cannot hold these
/// samples.
Result<CPLStringList> codec_options(const BuildOptions& options, const Mosaic& mosaic);

}  // namespace nadir::pyramid

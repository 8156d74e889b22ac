#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// Which codec, level and tile size suit which imagery: bytes against the time to decode them.
Suite codec_suite();

}  // namespace nadir::bench

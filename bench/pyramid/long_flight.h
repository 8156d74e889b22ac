#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// Frames along 500 km of a map of 2^20 x 2^20 texels, of which a strip under the flight holds data (a sixteenth of
/// that where a quick look is asked for): whether memory grows with the way.
Case long_flight(const RunOptions& options);

}  // namespace nadir::bench

#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// Integrators: error at the end of a motion against evaluations and run time, beside Boost.odeint; and where each
/// method breaks.
Suite integrate_suite();

}  // namespace nadir::bench

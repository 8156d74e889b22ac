#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// Whether frames take the work that they took before: counts that no clock and no other machine changes, against those
/// in expected.csv: one that differs is a fault of its case. Ratios to peers stand beside them, and are none.
Suite ci_suite();

}  // namespace nadir::bench

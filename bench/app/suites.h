#pragma once

#include <vector>

#include "build_suite.h"
#include "ci_suite.h"
#include "codec_suite.h"
#include "levels_suite.h"
#include "mapping_suite.h"
#include "motion_suite.h"
#include "nadir/bench/runner.h"
#include "read_suite.h"
#include "render_suite.h"
#include "sim_suite.h"
#ifdef NADIR_HAVE_ODEINT
#include "integrate_suite.h"
#endif

namespace nadir::bench {

/// What a command costs before it has anything to do: bench/app/start_suite.cpp.
Suite start_suite();
/// What becomes of views at the extremes: bench/app/stability_suite.cpp.
Suite stability_suite();

/// All suites that `nadir bench` knows: a new one is declared above and listed here.
inline std::vector<Suite> all_suites() {
  return {render_suite(),    read_suite(),    codec_suite(),  build_suite(),
          levels_suite(),    mapping_suite(), motion_suite(), sim_suite(),
#ifdef NADIR_HAVE_ODEINT
          integrate_suite(),
#endif
          stability_suite(), start_suite(),   ci_suite()};
}

}  // namespace nadir::bench

#pragma once

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// Each quality beside the peer that samples as much, warm, on one thread: CPU time and PSNR. Of interest only: no
/// ratio is a fault, and where a program or its library is missing its rows say so.
std::vector<Case> peer_cases(const RunOptions& options);

}  // namespace nadir::bench

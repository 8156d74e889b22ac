#pragma once

#include <string>
#include <vector>

#include "nadir/bench/runner.h"

namespace nadir::bench {

/// What Nadir's settings are meant to reach in a pose beside the peers that reach the same, for each number of threads
/// that rows have: which peer that is hangs on what was found. Rows with a method, its setting ("1 thread"), a time and
/// the counters `psnr_image_db` and `psnr_scene_db`; Nadir's begin with "nadir ".
std::vector<Aim> aims_of_view(const std::string& pose, const std::vector<Row>& rows);

}  // namespace nadir::bench

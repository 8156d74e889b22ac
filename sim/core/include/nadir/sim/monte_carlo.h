#pragma once

#include <functional>
#include <string>
#include <vector>

#include "nadir/sim/run_file.h"

namespace nadir::sim {

/// One vehicle's flight among many.
struct FlightOutcome {
  std::uint64_t seed = 0;
  std::string vehicle;
  double end_s = 0;                                       // of the last state told: of the run, unless it ended early
  double end_east_m = 0, end_north_m = 0, end_up_m = 0;   // at the scene's origin
  double worst_off_path_m = 0, worst_height_error_m = 0;  // either way, over the whole flight
  double least_airspeed_mps = 0, greatest_airspeed_mps = 0;
  double greatest_roll_rad = 0;    // either way
  std::vector<double> track_en_m;  // east and north of its track, at most 200 points evenly in time
  std::string fault;               // why it ended early
};

/// Flies a run `flights` times without its sensors, with the seeds `run.seed`, `run.seed` + 1, ...: every draw differs,
/// nothing else. Over the machine's cores, `threads` at most (0: all); results are in the order of seeds and the same
/// bits for any number of threads. How motion is stepped is planned once, for the first. `flown(n)`: n more are done;
/// called from any thread, one call at a time. A flight that ends early is an outcome; what cannot begin is a failure.
Result<std::vector<FlightOutcome>> fly_many(const RunFile& run, int flights, int threads,
                                            const std::function<void(int)>& flown = {});

}  // namespace nadir::sim

#pragma once

#include <functional>

#include "nadir/sim/flight.h"
#include "nadir/sim/plan.h"

namespace nadir::sim {

/// A flight from its start, its motion stepped by a scheme: the same one each time.
using MakeFlight = std::function<Result<Flight>(const Scheme&)>;

/// Chooses how a flight's motion is stepped: the cheapest scheme by counted work that keeps it within `tolerance_m` of
/// the exact motion (the adaptive one 1e-4 times tighter), autopilot and air included, over the first `trial_ns`. What
/// is compared is the position where periods end, and how far the attitude moves what lies a kilometre away. An
/// implicit scheme is tried where the explicit ones cost more than its least: one step a period. Fails where none keeps
/// to it. A crash ends the trial; a flight that diverges whatever the scheme gets RK4.
Result<Plan> plan_motion(const MakeFlight& make, double tolerance_m, std::int64_t trial_ns);

}  // namespace nadir::sim

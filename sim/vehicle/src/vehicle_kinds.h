#pragma once

#include <string>
#include <vector>

#include "nadir/sim/fixed_wing.h"
#include "nadir/sim/multirotor.h"
#include "nadir/sim/parameter_layer.h"

namespace nadir::sim {

// What a vehicle's file has to know of each kind of vehicle.

/// Takes the parameters of a layer into a vehicle and notes faults; what numbers mean together is checked where each of
/// them can be.
void apply(const ParameterLayer& layer, FixedWing& vehicle);
void apply(const ParameterLayer& layer, Multirotor& vehicle);

/// What is unusual but can be, one line each.
std::vector<std::string> warnings_of(const FixedWing& vehicle);
std::vector<std::string> warnings_of(const Multirotor& vehicle);

/// All parameters, as `apply` takes them.
std::string text_of(const FixedWing& vehicle);
std::string text_of(const Multirotor& vehicle);

}  // namespace nadir::sim
